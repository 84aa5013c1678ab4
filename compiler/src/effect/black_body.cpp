#include "effect/black_body.h"

#include "billow/format/exact_math.h"

namespace billow::compiler {
namespace {

constexpr double kSecondRadiation = 1.438776877e7;  // hc / k, nanometres times kelvin

// A Gaussian with a width of its own on either side.
double lobe(double nanometres, double peak, double left, double right) {
  const double t = (nanometres - peak) * (nanometres < peak ? left : right);
  return format::decay(t * t / 2);
}

std::array<double, 3> matching(double l) {
  return {0.362 * lobe(l, 442.0, 0.0624, 0.0374) + 1.056 * lobe(l, 599.8, 0.0264, 0.0323) -
              0.065 * lobe(l, 501.1, 0.0490, 0.0382),
          0.821 * lobe(l, 568.8, 0.0213, 0.0247) + 0.286 * lobe(l, 530.9, 0.0613, 0.0322),
          1.217 * lobe(l, 437.0, 0.0845, 0.0278) + 0.681 * lobe(l, 459.0, 0.0385, 0.0725)};
}

double planck(double nanometres, double kelvin) {
  const double m = nanometres * 1e-3;
  const double left = format::decay(kSecondRadiation / (nanometres * kelvin));
  return left / (1 - left) / (m * m * m * m * m);
}

}  // namespace

std::array<double, 3> blackBody(double kelvin) {
  std::array<double, 3> xyz{};
  for (int nanometres = 380; nanometres <= 780; nanometres += 5) {
    const auto weights = matching(nanometres);
    for (std::size_t i = 0; i < 3; ++i) xyz[i] += weights[i] * planck(nanometres, kelvin);
  }
  const auto [x, y, z] = xyz;  // IEC 61966-2-1
  return {std::max(0.0, 3.2406 * x - 1.5372 * y - 0.4986 * z), std::max(0.0, -0.9689 * x + 1.8758 * y + 0.0415 * z),
          std::max(0.0, 0.0557 * x - 0.2040 * y + 1.0570 * z)};
}

}  // namespace billow::compiler
