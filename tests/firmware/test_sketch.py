"""How a sketch becomes C++; no compiler is needed for it."""

import pytest

from firmware_emulator.native.sketch import SketchError, prototypes, translated


def test_every_function_gets_a_prototype_in_front_of_the_first():
    text = (
        "#include <x.h>\n"
        'const char *a = "int no(int) {";\n'
        "// int neither() {\n"
        "struct S { int inside() { return 1; } };\n"
        "static inline uint8_t first(uint8_t ch) {\n  if (ch) { }\n  return late(1, 2);\n}\n"
        "bool late(const uint8_t* a,\n          int b)\n{ for (;;) { } }\n"
    )
    at, found = prototypes(text)
    assert text[at:].startswith("static inline uint8_t first")
    assert found == ["static inline uint8_t first(uint8_t ch);", "bool late(const uint8_t* a, int b);"]


def test_lines_keep_their_numbers_and_the_hand_is_left_to_the_command_line(tmp_path):
    source, into = tmp_path / "hand", tmp_path / "out"
    source.mkdir()
    into.mkdir()
    (source / "hand.ino").write_text("int x;\nvoid setup() {}\nvoid loop() {}\n")
    (source / "HandConfig.h").write_text("#pragma once\n//#define LEFT_HAND\n#define RIGHT_HAND\n")
    (unit,) = translated(source, into, side="left")
    lines = unit.read_text().splitlines()
    assert lines[1] == f'#line 1 "{source / "hand.ino"}"'
    assert lines[lines.index("void setup();") + 2 :][:2] == [f'#line 2 "{source / "hand.ino"}"', "void setup() {}"]
    assert "\n#define RIGHT_HAND" not in (into / "HandConfig.h").read_text()


def test_a_folder_without_a_sketch_is_named(tmp_path):
    with pytest.raises(SketchError, match=r"neither an \.ino nor a \.cpp"):
        translated(tmp_path, tmp_path / "out", side=None)
