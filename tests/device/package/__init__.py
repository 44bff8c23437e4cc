"""How projects in C and C++ take Tumble in. A package, as each folder of tests has a conftest of its own."""
