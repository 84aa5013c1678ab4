// What the panel tells of streaming is what StreamStats says.
#include <gtest/gtest.h>

#include <string>

#include "traffic.h"

namespace billow::viewer {
namespace {

std::string all(const Traffic& traffic) {
  std::string text;
  for (const std::string& line : linesOf(traffic)) text += line + "\n";
  return text;
}

void expectSaid(const Traffic& traffic, const std::string& words) {
  EXPECT_NE(all(traffic).find(words), std::string::npos) << words << " in:\n" << all(traffic);
}

TEST(Traffic, TellsWhatStreamStatsSays) {
  runtime::StreamStats stats;
  stats.framesResident = 7;
  stats.gpuBytes = 3 << 19;
  stats.bytesRead = 1 << 20;
  stats.bytesDecompressed = 2 << 20;
  stats.bytesUploaded = 3 << 20;
  stats.framesLoaded = 5;
  stats.framesEvicted = 2;
  stats.framesLate = 1;
  stats.instances = 4;
  stats.instancesHeld = 3;
  stats.instancesCoarse = 2;
  stats.instancesEmpty = 1;
  stats.missingBricks[static_cast<std::size_t>(runtime::Missing::reading)] = 11;
  stats.missingBricks[static_cast<std::size_t>(runtime::Missing::gpuBudget)] = 13;
  Traffic traffic;
  traffic.add(stats, 0.25);
  traffic.add(stats, 0.25);
  expectSaid(traffic, "7 frames, 1.5 MiB");
  expectSaid(traffic, "loaded 10, evicted 4, late 2");
  expectSaid(traffic, "read 4.0, unpacked 8.0, up 12.0 MiB/s");
  expectSaid(traffic, "of 4: 3 held, 2 coarse, 1 empty");
  expectSaid(traffic, "missing bricks: 11 reading, 13 GPU budget");
}

TEST(Traffic, ComesToRest) {
  runtime::StreamStats stats;
  stats.bytesRead = 9 << 20;
  Traffic traffic;
  traffic.add(stats, 0.6);
  EXPECT_GT(traffic.rates().read, 0);
  traffic.add({}, 0.3);
  EXPECT_GT(traffic.rates().read, 0) << "a rate can be read for a while";
  traffic.add({}, 0.3);
  EXPECT_EQ(traffic.rates().read, 0);
  expectSaid(traffic, "nothing is missing");
}

}  // namespace
}  // namespace billow::viewer
