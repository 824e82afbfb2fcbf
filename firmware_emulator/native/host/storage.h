// Non-volatile storage: integers by `namespace/key`, kept by the kernel across resets.
#pragma once

#include <string>

namespace storage {

void load(const std::string& line);   // "namespace/key=value", from the kernel
bool get(const std::string& name, int64_t& value);
void put(const std::string& name, int64_t value);
bool forget(const std::string& name);
void forget_all(const std::string& prefix);

}  // namespace storage
