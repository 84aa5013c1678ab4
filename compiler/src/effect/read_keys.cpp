#include <algorithm>

#include "effect/read.h"

namespace billow::compiler {
namespace {

constexpr std::size_t kMostKeys = 256;

// [[time, value], ...]; `take` reads a value.
template <class Take>
Keys readKeys(const json::Value& value, const json::Range& times, const Take& take) {
  Keys keys;
  const auto items = value.items("a list of keys [time, value]");
  if (items.size() > kMostKeys) value.fail("at most 256 keys");
  for (const json::Value& item : items) {
    const auto pair = item.items(2, "a key [time, value]");
    const double time = pair[0].number(times);
    if (!keys.empty() && time <= keys.times.back()) pair[0].fail("a time after that of the key before");
    keys.times.push_back(time);
    keys.values.push_back(take(pair[1]));
  }
  return keys;
}

}  // namespace

std::array<double, 3> Keys::at(double time) const {
  const auto after = std::upper_bound(times.begin(), times.end(), time);
  if (after == times.begin()) return values.front();
  if (after == times.end()) return values.back();
  const auto right = static_cast<std::size_t>(after - times.begin());
  const double share = (time - times[right - 1]) / (times[right] - times[right - 1]);
  std::array<double, 3> result = values[right - 1];
  for (std::size_t i = 0; i < 3; ++i) result[i] += (values[right][i] - result[i]) * share;
  return result;
}

double Keys::integral(double time) const {
  double sum = 0;
  for (std::size_t i = 0; i < times.size() && times[i] < time; ++i) {
    const double end = i + 1 < times.size() ? std::min(times[i + 1], time) : time;
    sum += (values[i][0] + at(end)[0]) / 2 * (end - times[i]);
  }
  return sum;
}

Keys readCurve(const json::Value& value, const json::Range& times, const json::Range& values) {
  if (!value.isArray()) return {{times.low}, {{value.number(values), 0, 0}}};
  return readKeys(value, times, [&](const json::Value& v) { return std::array<double, 3>{v.number(values), 0, 0}; });
}

Keys readVectorCurve(const json::Value& value, const json::Range& times, const json::Range& values) {
  const auto items = value.items("three numbers, or a list of keys [time, [x, y, z]]");
  if (!items.front().isArray()) return {{times.low}, {value.numbers<3>(values)}};
  return readKeys(value, times, [&](const json::Value& v) { return v.numbers<3>(values); });
}

void readSpan(const json::Value& value, const json::Range& range, float (&into)[2]) {
  if (!value.isArray()) {
    into[0] = into[1] = value.single(range);
    return;
  }
  const auto both = value.singles<2>(range);
  if (both[1] < both[0]) value.fail("the smaller number first");
  into[0] = both[0];
  into[1] = both[1];
}

}  // namespace billow::compiler
