# Sets TUMBLE_PARTS to the parts of the library in capitals: the default features of Cargo.toml.
file(STRINGS ${CMAKE_CURRENT_LIST_DIR}/../Cargo.toml TUMBLE_PARTS REGEX "^default = ")
string(REGEX MATCHALL "\"[a-z_]+\"" TUMBLE_PARTS "${TUMBLE_PARTS}")
list(TRANSFORM TUMBLE_PARTS REPLACE "\"" "")
list(TRANSFORM TUMBLE_PARTS TOUPPER)
