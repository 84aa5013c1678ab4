// The frame thread's part alone: what it tells planning, and what it draws.
#include <gtest/gtest.h>

#include <random>
#include <vector>

#include "stream/players.h"
#include "stream_plan_fixture.h"

namespace billow::tests {
namespace {

// Planning may be just swapping when a report is there: it is filled anew then, and nothing that it told is lost.
TEST(StreamPlayers, NoticesOfAReportThatWasNotTakenGoFirst) {
  auto clip = std::make_shared<runtime::Clip>();
  clip->same = {0};
  clip->levels.resize(2);
  runtime::Players players;
  runtime::Report report;
  for (std::uint32_t number = 0; number < 4; ++number) {
    EXPECT_EQ(players.openClip(clip), number);
    players.fill(report);
    ASSERT_EQ(report.notices.size(), number + 1);
    for (std::uint32_t i = 0; i <= number; ++i) EXPECT_EQ(report.notices[i].clip, i);
  }
}

// Whatever comes, goes and changes, and however many reports are not taken.
TEST(StreamPlayers, ReportsTellPlanningWhatThereIs) {
  const auto clip = std::make_shared<runtime::Clip>();
  clip->same = {0};
  clip->levels.resize(2);
  runtime::Players players;
  const std::uint32_t number = players.openClip(clip);
  runtime::Report report;
  runtime::Snapshot snapshot;
  std::mt19937 random(8);
  std::vector<InstanceId> ids;
  for (int i = 0; i < 3000; ++i) {
    const InstanceId any = ids.empty() ? InstanceId{} : ids[random() % ids.size()];
    switch (random() % 6) {
      case 0:
        ids.push_back(*players.add({.time = i * 0.01, .priority = static_cast<float>(i)}, number));
        break;
      case 1:
        players.remove(any);
        std::erase(ids, any);
        break;
      case 2:
        players.setPriority(any, static_cast<float>(random() % 100));
        break;
      case 3:
        players.setTransform(any, {1, 0, 0, i * 1.0, 0, 1, 0, 0, 0, 0, 1, 0});
        break;
      case 4:
        players.setPlayback(any, {.speed = i * 0.1, .loop = Loop::once});
        break;
      default:
        players.fill(report);
        if (random() % 2 == 0) break;
        snapshot.take(report);
        ASSERT_EQ(snapshot.instances.size(), players.views().size());
        for (std::size_t at = 0; at < snapshot.instances.size(); ++at) {
          const runtime::InstanceView &told = snapshot.instances[at], &is = players.views()[at];
          ASSERT_EQ(told.id.value, is.id.value) << i;
          ASSERT_EQ(told.priority, is.priority) << i;
          ASSERT_EQ(told.centre, is.centre) << i;
          ASSERT_EQ(told.playback.speed, is.playback.speed) << i;
          ASSERT_EQ(told.phase, is.phase) << i;
        }
    }
  }
}

// The short way gives what the long one gives, whenever it may be taken.
TEST(StreamPlayers, GoingOnDrawsWhatChoosingAnewWould) {
  std::vector<format::FrameRecord> records(12);
  for (std::size_t i = 0; i < 12; ++i) records[i].time = static_cast<double>(i) / 24;
  const auto clip = std::make_shared<runtime::Clip>();
  clip->timeline = runtime::Timeline(records, 24);
  clip->same = {0, 1, 2, 3, 3, 5, 6, 7, 8, 9, 10, 11};
  clip->levels.resize(2);
  clip->velocity = true;
  runtime::Track track{.clip = clip, .slots = std::vector<runtime::Track::Slot>(24), .version = 1};
  std::mt19937 random(5);
  std::uint32_t shorter = 0;
  for (const Loop loop : {Loop::loop, Loop::pingPong, Loop::once}) {
    for (const Interpolation way : {Interpolation::hold, Interpolation::blend, Interpolation::advect}) {
      runtime::InstanceView view;
      view.playback = {.speed = 1, .loop = loop, .interpolation = way};
      runtime::Player player;
      runtime::Shown shown;
      for (int i = 0; i < 500; ++i) {
        if (random() % 20 == 0) {
          runtime::Track::Slot& slot = track.slots[random() % 24];
          slot.frame = slot.frame == nullptr ? std::make_unique<runtime::ResidentFrame>() : nullptr;
          ++track.version;
        }
        const double moved = random() % 50 == 0 ? 0.2 : 1.0 / 144;
        view.phase = wrapPhase(clip->timeline, loop, view.phase + moved);
        if (random() % 200 == 0) view.phase = clip->timeline.last();
        runtime::Player other = player;
        runtime::Shown wanted = shown;
        chooseLayers(track, view, other, wanted, moved, 1.0f / 144);
        if (!goOn(track, view, player, shown, 1.0f / 144)) {
          player = other;
          shown = wanted;
          continue;
        }
        ++shorter;
        ASSERT_EQ(shown.count, wanted.count) << i;
        ASSERT_EQ(shown.time, wanted.time) << i;
        ASSERT_EQ(shown.held, wanted.held) << i;
        ASSERT_EQ(shown.coarse, wanted.coarse) << i;
        ASSERT_EQ(player.near, other.near) << i;
        for (std::uint32_t layer = 0; layer < shown.count; ++layer) {
          ASSERT_EQ(shown.items[layer], wanted.items[layer]) << i;
          ASSERT_NEAR(shown.weights[layer], wanted.weights[layer], 1e-5f) << i;
          ASSERT_NEAR(shown.advect[layer], wanted.advect[layer], 1e-6f) << i;
          ASSERT_EQ(player.fades[layer].seen, other.fades[layer].seen) << i;
        }
      }
    }
  }
  EXPECT_GT(shorter, 400u);
}

TEST(StreamPlayers, OnlyAShrunkBudgetTakesTheLastFrameOfAnInstance) {
  auto clip = std::make_shared<runtime::Clip>();
  clip->same = {0};
  clip->levels.resize(2);
  runtime::Players players;
  FakeTransport transport({}, {});
  ASSERT_TRUE(players.add({}, players.openClip(clip)));
  std::uint32_t drawn = 0;
  const auto change = [&](runtime::Change::Kind kind, std::unique_ptr<runtime::ResidentFrame> frame) {
    runtime::Change made{.kind = kind, .clip = 0, .item = 0, .instance = {}, .frame = std::move(frame)};
    players.take({&made, 1}, transport);
    players.advance(0);
    runtime::Report report;
    players.fill(report);
    drawn = report.moments[0].drawnCount;
    return std::move(report.notices);
  };
  change(runtime::Change::Kind::arrive, std::make_unique<runtime::ResidentFrame>());
  EXPECT_EQ(drawn, 1u);
  auto notices = change(runtime::Change::Kind::force, nullptr);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0].kind, runtime::Notice::Kind::refused);
  EXPECT_EQ(drawn, 1u);
  notices = change(runtime::Change::Kind::seize, nullptr);
  ASSERT_EQ(notices.size(), 1u);
  EXPECT_EQ(notices[0].kind, runtime::Notice::Kind::retired);
  EXPECT_EQ(drawn, 0u);
  for (int i = 0; i < 5; ++i) transport.update();
}

}  // namespace
}  // namespace billow::tests
