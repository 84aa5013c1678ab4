// The same in C++, beside billow.hpp.
#include <billow/billow.hpp>

#include "every_function.c"
