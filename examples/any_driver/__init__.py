"""A hand for a test of any driver: C, JavaScript, and the SDK of the maker."""
