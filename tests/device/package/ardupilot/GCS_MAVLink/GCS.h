#include <stand_ins.hpp>
