"""The example is its own test: a C program, a Node script and the maker's SDK with a fault in the middle."""

from any_driver.test_any_driver import (  # noqa: F401
    test_a_driver_in_c,
    test_a_driver_in_javascript,
    test_the_sdk_of_the_maker,
)
