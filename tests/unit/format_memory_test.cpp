// Memory that runs out anywhere in reading is an issue, never an exception.
#include <gtest/gtest.h>

#include <atomic>
#include <new>
#include <type_traits>

#include "billow/format/grid_view.h"
#include "billow/format/validate.h"
#include "sample_pack.h"

namespace billow {
namespace {

using namespace format;

static_assert(!std::is_copy_constructible_v<GridView> && !std::is_copy_assignable_v<GridView>);
static_assert(std::is_nothrow_move_constructible_v<GridView> && std::is_nothrow_move_assignable_v<GridView>);

constexpr std::uint16_t kMemory = 6;

// Has no memory left once `reads` reads were served.
class PoorSource : public ByteSource {
 public:
  PoorSource(std::vector<std::byte> bytes, const std::atomic<int>& reads)
      : inner_(makeMemorySource(std::move(bytes))), reads_(reads) {}
  std::uint64_t size() const override { return inner_->size(); }
  bool read(std::uint64_t offset, std::span<std::byte> into) const override {
    if (served_++ >= reads_) throw std::bad_alloc();
    return inner_->read(offset, into);
  }

 private:
  std::unique_ptr<ByteSource> inner_;
  const std::atomic<int>& reads_;
  mutable std::atomic<int> served_ = 0;
};

TEST(Memory, OpenSaysSo) {
  int failures = 0;
  for (std::atomic<int> reads = 0;; ++reads) {
    const Result<Pack> pack = Pack::open(std::make_unique<PoorSource>(tests::samplePack(), reads));
    if (pack) break;
    EXPECT_EQ(pack.error().kind->id, kMemory) << toString(pack.error());
    ++failures;
  }
  EXPECT_GE(failures, 8);  // header, contents, six tables at least
}

TEST(Memory, PagesAndViewsSaySo) {
  std::atomic<int> reads = 1 << 20;
  const Result<Pack> pack = Pack::open(std::make_unique<PoorSource>(tests::samplePack(), reads));
  ASSERT_TRUE(pack);
  reads = 0;
  const Result<Page> page = pack->readPage(0);
  ASSERT_FALSE(page);
  EXPECT_EQ(page.error().kind->id, kMemory);
  const Result<GridView> view = GridView::load(*pack, pack->gridFrames()[0]);
  ASSERT_FALSE(view);
  EXPECT_EQ(view.error().kind->id, kMemory);
}

TEST(Memory, ValidateSaysSoLast) {
  for (const unsigned threads : {1u, 4u}) {
    for (const int given : {0, 3, 9, 12}) {
      const std::atomic<int> reads = given;
      std::vector<Issue> issues;
      validate(PoorSource(tests::samplePack(), reads), {.threads = threads},
               [&](const Issue& issue) { issues.push_back(issue); });
      ASSERT_FALSE(issues.empty()) << given;
      EXPECT_EQ(issues.back().kind->id, kMemory) << given;
    }
  }
}

}  // namespace
}  // namespace billow
