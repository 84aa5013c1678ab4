#include "json/look.h"

#include <vector>

#include "billow/format/look.h"

namespace billow::json {

format::LookRecord readLook(const Value& value, std::initializer_list<std::string_view> furtherKeys) {
  std::vector<std::string_view> keys;
  for (const format::LookField& field : format::kLookFields) keys.push_back(field.name);
  keys.insert(keys.end(), furtherKeys);
  value.requireKeys(keys);
  format::LookRecord look{};
  for (std::uint32_t i = 0; i < format::kLookFieldCount; ++i) {
    const format::LookField& field = format::kLookFields[i];
    const auto member = value.find(field.name);
    if (!member) continue;
    const Range range{double{field.low}, double{field.high}, field.open};
    if (field.count == 1) {
      const float number = member->single(range);
      format::setLook(look, i, {&number, 1});
    } else {
      format::setLook(look, i, member->singles<3>(range));
    }
  }
  return look;
}

}  // namespace billow::json
