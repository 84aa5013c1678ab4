#include "report/rate_curves.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <memory>

#include "billow/format/psnr.h"
#include "choose/choose.h"
#include "parallel.h"
#include "report/encodings.h"

namespace billow::command {
namespace {

using compiler::Choice;

constexpr double kStep = 2;       // dB between the points of a curve
constexpr double kHeadroom = 14;  // dB above the pack's own error that curves go on
constexpr double kHighest = 100;  // dB; above what a picture can show
constexpr float kAnyError = std::numeric_limits<float>::infinity();

class Curves {
 public:
  Curves(const compiler::ImportedGrid& source, const ReportFrame& frame, int effort)
      : source_(source), frame_(frame), effort_(effort) {
    tryAll();
  }

  RateCurve family(std::size_t f) const {
    const EncodingFamily& family = encodingFamilies()[f];
    std::size_t begin = 0;
    for (std::size_t other = 0; other < f; ++other) begin += encodingFamilies()[other].tried;
    std::vector<std::vector<Choice>> choices(trials_.size());
    for (std::size_t i = 0; i < trials_.size(); ++i) {
      const auto first = trials_[i].begin() + static_cast<std::ptrdiff_t>(begin);
      choices[i].assign(first, first + family.tried);
      if (f != 0) choices[i].push_back(trials_[i][0]);
    }
    RateCurve curve = draw(choices);
    curve.name = family.name;
    curve.colour = fmt::format("c{}", f);
    for (std::uint32_t e = family.first; e <= family.last; ++e) {
      curve.encodings += fmt::format("{}{}", e == family.first ? "" : " ", e);
    }
    return curve;
  }

  RateCurve mix() const {
    RateCurve curve = draw(withoutLocal());
    curve.name = "mix of --psnr";
    curve.colour = "mix";
    return curve;
  }

 private:
  void tryAll() {
    trials_.resize(source_.leaves.size());
    compiler::parallelRanges(trials_.size(), 16, [this](std::size_t begin, std::size_t end) {
      const auto candidate = std::make_unique<compiler::Candidate>();
      for (std::size_t i = begin; i != end; ++i) tryBrick(i, *candidate);
    });
  }

  void tryBrick(std::size_t i, compiler::Candidate& candidate) {
    const compiler::Leaf& leaf = source_.leaves[i];
    std::uint32_t count = 0;
    for (const std::uint32_t word : leaf.active.words) count += static_cast<std::uint32_t>(std::popcount(word));
    for (const EncodingFamily& family : encodingFamilies()) {
      for (std::uint32_t t = 0; t < family.tried; ++t) {
        family.encode({&leaf.values, &leaf.active, count, source_.background}, family.first + t, effort_, candidate);
        const bool mask = count != format::kBrickVoxels && !candidate.texelMask;
        const auto bytes = *format::brickBytes(candidate.encoding) + (mask ? std::uint32_t{sizeof(format::Mask3)} : 0);
        trials_[i].push_back({bytes, candidate.squaredError, candidate.maxError});
      }
    }
  }

  // What --psnr may choose from: local bricks are for --gpu-budget alone.
  std::vector<std::vector<Choice>> withoutLocal() const {
    std::size_t begin = 0, end = 0;
    for (const EncodingFamily& family : encodingFamilies()) {
      if (format::isLocal(family.first)) end = begin + family.tried;
      if (end == 0) begin += family.tried;
    }
    std::vector<std::vector<Choice>> choices = trials_;
    for (std::vector<Choice>& brick : choices) {
      brick.erase(brick.begin() + static_cast<std::ptrdiff_t>(begin), brick.begin() + static_cast<std::ptrdiff_t>(end));
    }
    return choices;
  }

  double voxels() const { return static_cast<double>(source_.activeVoxels); }

  double bitsOf(std::uint64_t bytes) const {
    return static_cast<double>(frame_.gpu.index + frame_.gpu.headers + bytes) * 8 / voxels();
  }

  // Nothing where the error is 0: that is no point on a scale of decibels.
  void addPoint(RateCurve& curve, std::uint64_t bytes, double squaredError) const {
    if (!(squaredError > 0)) return;
    const double psnr = format::psnr(frame_.row.range, squaredError, source_.activeVoxels);
    const double bits = bitsOf(bytes);
    if (!curve.points.empty() && bits <= curve.points.back().bits) return;
    curve.points.push_back({bits, psnr});
  }

  std::optional<std::uint64_t> bytesAt(const std::vector<std::vector<Choice>>& choices, double budget,
                                       double& squaredError) const {
    const auto allocation = compiler::allocate(choices, budget, kAnyError);
    if (!allocation) return std::nullopt;
    std::uint64_t bytes = 0;
    squaredError = 0;
    for (std::size_t i = 0; i < choices.size(); ++i) {
      const Choice& choice = choices[i][allocation->chosen[i]];
      bytes += choice.bytes;
      squaredError += choice.squaredError;
    }
    return bytes;
  }

  RateCurve draw(const std::vector<std::vector<Choice>>& choices) const {
    RateCurve curve;
    if (choices.empty() || !(frame_.row.range > 0)) return curve;
    double squaredError = 0;
    if (const auto bytes = bytesAt(choices, frame_.row.error.squaredError, squaredError)) curve.bits = bitsOf(*bytes);
    const auto cheapest = bytesAt(choices, std::numeric_limits<double>::infinity(), squaredError);
    addPoint(curve, *cheapest, squaredError);
    if (curve.points.empty()) return curve;
    const double last = std::min(frame_.row.psnr() + kHeadroom, kHighest);
    const auto firstStep = static_cast<int>(std::ceil(curve.points[0].psnr / kStep));
    for (int step = firstStep; step * kStep <= last; ++step) {
      const double psnr = step * kStep;
      const double rmse = frame_.row.range / std::pow(10.0, psnr / 20);
      const auto bytes = bytesAt(choices, rmse * rmse * voxels(), squaredError);
      if (!bytes) break;
      addPoint(curve, *bytes, squaredError);
    }
    if (curve.points.back().psnr < last) addBest(choices, last, curve);
    return curve;
  }

  // Where the curve ends below `last` dB: every brick at its least error.
  void addBest(const std::vector<std::vector<Choice>>& choices, double last, RateCurve& curve) const {
    std::uint64_t bytes = 0;
    double squaredError = 0;
    for (const std::vector<Choice>& brick : choices) {
      const Choice& best = *std::min_element(brick.begin(), brick.end(), [](const Choice& a, const Choice& b) {
        return a.squaredError != b.squaredError ? a.squaredError < b.squaredError : a.bytes < b.bytes;
      });
      bytes += best.bytes;
      squaredError += best.squaredError;
    }
    addPoint(curve, bytes, squaredError);
    if (curve.points.back().psnr > last + kStep) curve.points.pop_back();
  }

  const compiler::ImportedGrid& source_;
  const ReportFrame& frame_;
  const int effort_;
  std::vector<std::vector<Choice>> trials_;  // by leaf, then by family and encoding tried
};

}  // namespace

std::vector<RateCurve> measureCurves(const compiler::ImportedGrid& source, const ReportFrame& frame, int effort) {
  const Curves measured(source, frame, effort);
  std::vector<RateCurve> curves;
  for (std::size_t f = 0; f < encodingFamilies().size(); ++f) curves.push_back(measured.family(f));
  curves.push_back(measured.mix());
  return curves;
}

}  // namespace billow::command
