// The look of a volume, as manifests and scenes describe it.
#ifndef BILLOW_JSON_LOOK_H
#define BILLOW_JSON_LOOK_H

#include <initializer_list>
#include <string_view>

#include "billow/format/layout.h"
#include "json/value.h"

namespace billow::json {

// Reads an object whose members are named and bounded as the fields of a LookRecord, any of which may be absent, or
// one of furtherKeys, which are left to the caller. Throws Error.
format::LookRecord readLook(const Value& value, std::initializer_list<std::string_view> furtherKeys = {});

}  // namespace billow::json

#endif  // BILLOW_JSON_LOOK_H
