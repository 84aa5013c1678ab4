// spec/smallest.md is the smallest pack, annotated.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <map>
#include <string>

#include "billow/format/validate.h"
#include "pack_image.h"
#include "sample_pack.h"
#include "spec_document.h"
#include "struct_layouts.h"

namespace billow {
namespace {

using namespace format;
using namespace tests;

class Dump {
 public:
  explicit Dump(std::vector<std::byte> bytes) : bytes_(std::move(bytes)) {}

  void title(const std::string& text) { out_ += fmt::format("\n{}\n", text); }
  // The next `size` bytes, in rows of eight; rows of zeros are counted.
  void field(std::size_t size, const std::string& note) {
    for (std::size_t done = 0; done < size;) {
      const std::size_t count = std::min<std::size_t>(8, size - done);
      std::string hex;
      for (std::size_t i = 0; i < count; ++i) {
        hex += fmt::format("{:02x} ", std::to_integer<unsigned>(bytes_.at(at_ + done + i)));
      }
      if (done > 0 && done + 8 < size && zeros(at_ + done, size - done)) {
        out_ += fmt::format("{:04x}  {} bytes of 00\n", at_ + done, size - done);
        break;
      }
      hex.pop_back();
      out_ += fmt::format("{:04x}  {}\n", at_ + done, done == 0 ? fmt::format("{:24} {}", hex, note) : hex);
      done += count;
    }
    at_ += size;
  }
  void padding(std::size_t to) {
    if (to > at_) field(to - at_, "padding");
  }
  template <class T>
  T peek(std::size_t offset = 0) const {
    return getAt<T>(bytes_, at_ + offset);
  }
  std::size_t at() const { return at_; }
  std::size_t size() const { return bytes_.size(); }
  const std::string& text() const { return out_; }

 private:
  bool zeros(std::size_t from, std::size_t count) const {
    return std::all_of(bytes_.begin() + static_cast<std::ptrdiff_t>(from),
                       bytes_.begin() + static_cast<std::ptrdiff_t>(from + count),
                       [](std::byte byte) { return byte == std::byte{0}; });
  }

  std::vector<std::byte> bytes_;
  std::size_t at_ = 0;
  std::string out_;
};

void dumpStruct(Dump& dump, const std::string& name, const std::map<std::string, std::string>& notes) {
  for (const Field& field : layouts().at(name).fields) {
    const auto note = notes.find(field.name);
    dump.field(field.size, note == notes.end() ? field.name : field.name + ": " + note->second);
  }
}

std::string smallestDocument() {
  Dump dump(smallestPack());
  const auto header = dump.peek<FileHeader>();
  dump.title("FileHeader");
  dumpStruct(dump, "FileHeader",
             {{"versionMajor", "1"},
              {"versionMinor", "0"},
              {"sectionCount", std::to_string(header.sectionCount)},
              {"fileSize", std::to_string(header.fileSize)},
              {"contentsOffset", "64"},
              {"contentsChecksum", "of bytes 0040 to 013f"},
              {"headerChecksum", "of bytes 0000 to 0037"}});
  std::vector<SectionEntry> sections;
  for (std::uint32_t i = 0; i < header.sectionCount; ++i) {
    sections.push_back(dump.peek<SectionEntry>());
    const SectionEntry& section = sections.back();
    std::string type(4, ' ');
    std::memcpy(type.data(), &section.type, 4);
    dump.title(fmt::format("SectionEntry {}", i));
    dumpStruct(dump, "SectionEntry",
               {{"type", type},
                {"flags", "required"},
                {"offset", fmt::format("{:04x}", section.offset)},
                {"size", std::to_string(section.size)}});
  }
  const std::map<std::uint32_t, std::pair<std::string, std::map<std::string, std::string>>> kTables = {
      {kSectionVolumes,
       {"VolumeRecord",
        {{"name", "\"v\""},
         {"gridCount", "1"},
         {"frameCount", "1"},
         {"framesPerSecond", "24"},
         {"look", "nothing is set"}}}},
      {kSectionGrids,
       {"GridRecord",
        {{"name", "\"density\""}, {"role", "extinction"}, {"sourceType", "float"}, {"component", "NONE: scalar"}}}},
      {kSectionFrames, {"FrameRecord", {{"number", "7"}, {"time", "0 s"}}}},
      {kSectionGridFrames,
       {"GridFrame",
        {{"flags", "not present"},
         {"node5", "NONE"},
         {"activeMax", "-1: the box is empty"},
         {"indexToWorld", "the identity"}}}}};
  for (const SectionEntry& section : sections) {
    dump.padding(section.offset);
    std::string type(4, ' ');
    std::memcpy(type.data(), &section.type, 4);
    const auto table = kTables.find(section.type);
    dump.title(fmt::format("{}{}", type,
                           section.size == 0        ? ": empty"
                           : table == kTables.end() ? ""
                                                    : ": one " + table->second.first));
    if (table != kTables.end()) {
      dumpStruct(dump, table->second.first, table->second.second);
    } else if (section.size > 0) {
      dump.field(section.size, "\"vdensity\"");
    }
  }
  EXPECT_EQ(dump.at(), dump.size());
  return fmt::format(
      "# A whole pack\n\nGenerated from the code. The smallest pack that has a frame: one volume \"v\" with one grid "
      "\"density\" and one\nframe, number 7, which lacks the grid; no pages. Structs are those of "
      "[format.md](format.md); "
      "offsets are hexadecimal.\n\n```\n{}```\n",
      dump.text().substr(1));
}

TEST(Spec, SmallestPackIsAnnotated) {
  expectDocument("smallest.md", smallestDocument());
}

}  // namespace
}  // namespace billow
