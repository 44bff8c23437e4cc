"""Integration of Tumble into C and C++ projects. A package, as each folder of tests has a conftest of its
own.
"""
