// The parts of String and Print used by sketches.
#pragma once

#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#define DEC 10
#define HEX 16
#define OCT 8
#define BIN 2
#define F(text) (text)

class String {
 public:
  String(const char* text = "") : text_(text ? text : "") {}
  String(const std::string& text) : text_(text) {}
  explicit String(char value) : text_(1, value) {}
  explicit String(unsigned char value, int base = DEC) : text_(number(value, base)) {}
  explicit String(int value, int base = DEC) : text_(value < 0 ? "-" + number(-(long long)value, base) : number(value, base)) {}
  explicit String(unsigned value, int base = DEC) : text_(number(value, base)) {}
  explicit String(long value, int base = DEC) : text_(value < 0 ? "-" + number(-(long long)value, base) : number(value, base)) {}
  explicit String(unsigned long value, int base = DEC) : text_(number(value, base)) {}
  explicit String(float value, int digits = 2) : text_(decimal(value, digits)) {}
  explicit String(double value, int digits = 2) : text_(decimal(value, digits)) {}

  const char* c_str() const { return text_.c_str(); }
  unsigned length() const { return text_.size(); }
  char charAt(unsigned at) const { return at < text_.size() ? text_[at] : 0; }
  char operator[](unsigned at) const { return charAt(at); }
  int indexOf(char what) const { return found(text_.find(what)); }
  int indexOf(const String& what) const { return found(text_.find(what.text_)); }
  String substring(unsigned from, unsigned to = ~0u) const {
    return from >= text_.size() || to < from ? String() : String(text_.substr(from, to == ~0u ? std::string::npos : to - from));
  }
  bool startsWith(const String& what) const { return text_.compare(0, what.text_.size(), what.text_) == 0; }
  bool equals(const String& other) const { return text_ == other.text_; }
  int toInt() const { return atoi(text_.c_str()); }
  float toFloat() const { return static_cast<float>(atof(text_.c_str())); }
  void trim() {
    size_t from = text_.find_first_not_of(" \t\r\n"), to = text_.find_last_not_of(" \t\r\n");
    text_ = from == std::string::npos ? "" : text_.substr(from, to - from + 1);
  }
  bool operator==(const String& other) const { return text_ == other.text_; }
  bool operator!=(const String& other) const { return text_ != other.text_; }
  String& operator+=(const String& other) { text_ += other.text_; return *this; }
  String& operator+=(char other) { text_ += other; return *this; }
  friend String operator+(const String& a, const String& b) { return String(a.text_ + b.text_); }
  friend String operator+(const String& a, char b) { return String(a.text_ + b); }
  template <typename Number> friend String operator+(const String& a, Number b) { return String(a.text_ + String(b).text_); }

 private:
  static int found(size_t at) { return at == std::string::npos ? -1 : static_cast<int>(at); }
  static std::string number(unsigned long long value, int base) {
    std::string digits;
    do digits.insert(digits.begin(), "0123456789ABCDEF"[value % base]); while (value /= base);
    return digits;
  }
  static std::string decimal(double value, int digits) {
    char text[64];
    snprintf(text, sizeof text, "%.*f", digits, value);
    return text;
  }
  std::string text_;
};

class Print {
 public:
  virtual ~Print() = default;
  virtual size_t write(uint8_t byte) { return write(&byte, 1); }
  virtual size_t write(const uint8_t* data, size_t size) = 0;
  size_t write(const char* text) { return write(reinterpret_cast<const uint8_t*>(text), strlen(text)); }
  size_t write(const char* data, size_t size) { return write(reinterpret_cast<const uint8_t*>(data), size); }
  size_t print(const char* text) { return write(text); }
  size_t print(const String& text) { return write(text.c_str()); }
  size_t print(char value) { return write(static_cast<uint8_t>(value)); }
  template <typename Number> size_t print(Number value) { return print(String(value)); }
  template <typename Number> size_t print(Number value, int base) { return print(String(value, base)); }
  size_t println() { return write("\r\n"); }
  template <typename... What> size_t println(What... what) { size_t n = print(what...); return n + println(); }
  size_t printf(const char* format, ...) __attribute__((format(printf, 2, 3))) {
    va_list arguments;
    va_start(arguments, format);
    char text[1024];
    int n = vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return n < 0 ? 0 : write(text, static_cast<size_t>(n) < sizeof text ? n : sizeof text - 1);
  }
  virtual void flush() {}
};
