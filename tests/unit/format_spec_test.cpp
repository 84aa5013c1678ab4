// The standard and the code say the same: byte tables, the list of rules, and an annotated pack.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cctype>
#include <cstdlib>
#include <map>
#include <set>
#include <sstream>

#include "billow/format/effect.h"
#include "billow/format/validate.h"
#include "pack_image.h"
#include "sample_pack.h"
#include "spec_document.h"

namespace billow {
namespace {

using namespace format;
using tests::expectDocument;
using tests::readSpec;

// ---- Byte tables

struct Field {
  std::string name;
  std::size_t offset, size;
  bool operator==(const Field&) const = default;
};
void PrintTo(const Field& field, std::ostream* out) {
  *out << field.name << " " << field.offset << " " << field.size;
}

struct Layout {
  std::size_t size;
  std::vector<Field> fields;
  bool operator==(const Layout&) const = default;
};

#define FIELD(type, member)                               \
  Field {                                                 \
#member, offsetof(type, member), sizeof(type::member) \
  }

const std::map<std::string, Layout>& layouts() {
  static const std::map<std::string, Layout> all = {
      {"FileHeader",
       {sizeof(FileHeader),
        {FIELD(FileHeader, magic), FIELD(FileHeader, versionMajor), FIELD(FileHeader, versionMinor),
         FIELD(FileHeader, sectionCount), FIELD(FileHeader, fileSize), FIELD(FileHeader, contentsOffset),
         FIELD(FileHeader, contentsChecksum), FIELD(FileHeader, reserved), FIELD(FileHeader, headerChecksum)}}},
      {"SectionEntry",
       {sizeof(SectionEntry),
        {FIELD(SectionEntry, type), FIELD(SectionEntry, flags), FIELD(SectionEntry, offset), FIELD(SectionEntry, size),
         FIELD(SectionEntry, checksum)}}},
      {"StringRef", {sizeof(StringRef), {FIELD(StringRef, offset), FIELD(StringRef, size)}}},
      {"VolumeRecord",
       {sizeof(VolumeRecord),
        {FIELD(VolumeRecord, name), FIELD(VolumeRecord, firstGrid), FIELD(VolumeRecord, gridCount),
         FIELD(VolumeRecord, firstFrame), FIELD(VolumeRecord, frameCount), FIELD(VolumeRecord, firstGridFrame),
         FIELD(VolumeRecord, framesPerSecond), FIELD(VolumeRecord, look)}}},
      {"LookRecord",
       {sizeof(LookRecord),
        {FIELD(LookRecord, set), FIELD(LookRecord, extinctionScale), FIELD(LookRecord, albedo),
         FIELD(LookRecord, anisotropy), FIELD(LookRecord, emissionScale), FIELD(LookRecord, temperatureScale),
         FIELD(LookRecord, temperatureOffset), FIELD(LookRecord, ambient), FIELD(LookRecord, reserved)}}},
      {"GridRecord",
       {sizeof(GridRecord),
        {FIELD(GridRecord, name), FIELD(GridRecord, role), FIELD(GridRecord, sourceType), FIELD(GridRecord, component),
         FIELD(GridRecord, volume), FIELD(GridRecord, reserved)}}},
      {"FrameRecord",
       {sizeof(FrameRecord), {FIELD(FrameRecord, number), FIELD(FrameRecord, flags), FIELD(FrameRecord, time)}}},
      {"GridFrame",
       {sizeof(GridFrame),
        {FIELD(GridFrame, flags),         FIELD(GridFrame, node5),         FIELD(GridFrame, origin),
         FIELD(GridFrame, activeMin),     FIELD(GridFrame, activeMax),     FIELD(GridFrame, background),
         FIELD(GridFrame, valueMin),      FIELD(GridFrame, valueMax),      FIELD(GridFrame, sourceMin),
         FIELD(GridFrame, sourceMax),     FIELD(GridFrame, maxError),      FIELD(GridFrame, reserved),
         FIELD(GridFrame, squaredError),  FIELD(GridFrame, indexToWorld),  FIELD(GridFrame, activeVoxels),
         FIELD(GridFrame, pageListBegin), FIELD(GridFrame, pageListCount), FIELD(GridFrame, node4Count),
         FIELD(GridFrame, node3Count),    FIELD(GridFrame, maskCount),     FIELD(GridFrame, childCount),
         FIELD(GridFrame, tileCount),     FIELD(GridFrame, brickCount),    FIELD(GridFrame, brickUnits),
         FIELD(GridFrame, reserved2)}}},
      {"PageRecord",
       {sizeof(PageRecord),
        {FIELD(PageRecord, offset), FIELD(PageRecord, checksum), FIELD(PageRecord, storedSize),
         FIELD(PageRecord, rawSize), FIELD(PageRecord, codec), FIELD(PageRecord, rawChecksum),
         FIELD(PageRecord, streams)}}},
      {"StreamRange", {sizeof(StreamRange), {FIELD(StreamRange, first), FIELD(StreamRange, count)}}},
      {"Node5",
       {sizeof(Node5),
        {FIELD(Node5, childBegin), FIELD(Node5, flags), FIELD(Node5, tile), FIELD(Node5, min), FIELD(Node5, max),
         FIELD(Node5, mean), FIELD(Node5, mask)}}},
      {"Node4",
       {sizeof(Node4),
        {FIELD(Node4, childBegin), FIELD(Node4, flags), FIELD(Node4, tile), FIELD(Node4, min), FIELD(Node4, max),
         FIELD(Node4, mean), FIELD(Node4, mask)}}},
      {"Node3",
       {sizeof(Node3),
        {FIELD(Node3, brick), FIELD(Node3, mask), FIELD(Node3, lo), FIELD(Node3, scale), FIELD(Node3, mean)}}},
      {"EffectRecord",
       {sizeof(EffectRecord),
        {FIELD(EffectRecord, name), FIELD(EffectRecord, firstEmitter), FIELD(EffectRecord, emitterCount),
         FIELD(EffectRecord, flags), FIELD(EffectRecord, seed), FIELD(EffectRecord, duration),
         FIELD(EffectRecord, reserved)}}},
      {"SpawnSpan",
       {sizeof(SpawnSpan),
        {FIELD(SpawnSpan, begin), FIELD(SpawnSpan, end), FIELD(SpawnSpan, first), FIELD(SpawnSpan, count)}}},
      {"EmitterRecord",
       {sizeof(EmitterRecord),
        {FIELD(EmitterRecord, name),        FIELD(EmitterRecord, firstSpan),    FIELD(EmitterRecord, spanCount),
         FIELD(EmitterRecord, flags),       FIELD(EmitterRecord, shape),        FIELD(EmitterRecord, extent),
         FIELD(EmitterRecord, position),    FIELD(EmitterRecord, positionRow),  FIELD(EmitterRecord, inheritance),
         FIELD(EmitterRecord, lifetime),    FIELD(EmitterRecord, direction),    FIELD(EmitterRecord, spreadCosine),
         FIELD(EmitterRecord, speed),       FIELD(EmitterRecord, gravity),      FIELD(EmitterRecord, drag),
         FIELD(EmitterRecord, wind),        FIELD(EmitterRecord, kind),         FIELD(EmitterRecord, radius),
         FIELD(EmitterRecord, radiusRow),   FIELD(EmitterRecord, proportions),  FIELD(EmitterRecord, extinction),
         FIELD(EmitterRecord, opacityRow),  FIELD(EmitterRecord, diffuse),      FIELD(EmitterRecord, diffuseRow),
         FIELD(EmitterRecord, emission),    FIELD(EmitterRecord, emissionRow),  FIELD(EmitterRecord, axis),
         FIELD(EmitterRecord, rotationRow), FIELD(EmitterRecord, displacement), FIELD(EmitterRecord, displacementRow),
         FIELD(EmitterRecord, firstMap),    FIELD(EmitterRecord, mapCount),     FIELD(EmitterRecord, mapsPerSecond),
         FIELD(EmitterRecord, material),    FIELD(EmitterRecord, reserved)}}},
      {"ParticleMaterial",
       {sizeof(ParticleMaterial),
        {FIELD(ParticleMaterial, profile), FIELD(ParticleMaterial, profileRow), FIELD(ParticleMaterial, diffuseRamp),
         FIELD(ParticleMaterial, emissionRamp), FIELD(ParticleMaterial, erosion),
         FIELD(ParticleMaterial, erosionFrequency), FIELD(ParticleMaterial, occlusion),
         FIELD(ParticleMaterial, softness)}}},
      {"Mask3", {sizeof(Mask3), {FIELD(Mask3, words)}}}};
  return all;
}

// Byte tables of format.md: "### `Name` (N bytes)", then rows "| offset | size | `field` | ...".
std::map<std::string, Layout> documentedLayouts() {
  std::map<std::string, Layout> all;
  std::istringstream text(readSpec("format.md"));
  std::string line, name;
  while (std::getline(text, line)) {
    if (line.rfind("### `", 0) == 0) {
      const std::size_t end = line.find('`', 5);
      name = line.substr(5, end - 5);
      all[name].size = static_cast<std::size_t>(std::atoi(line.c_str() + end + 3));
    } else if (line.starts_with('#')) {
      name.clear();
    } else if (!name.empty() && line.starts_with("| ") && std::isdigit(static_cast<unsigned char>(line[2])) != 0) {
      std::istringstream row(line);
      std::string bar, field;
      std::size_t offset = 0, size = 0;
      row >> bar >> offset >> bar >> size >> bar >> field;
      all[name].fields.push_back({field.substr(1, field.size() - 2), offset, size});
    }
  }
  return all;
}

TEST(Spec, ByteTablesAreThoseOfTheCode) {
  const std::map<std::string, Layout> documented = documentedLayouts();
  for (const auto& [name, layout] : layouts()) {
    ASSERT_TRUE(documented.contains(name)) << name;
    EXPECT_EQ(documented.at(name).size, layout.size) << name;
    EXPECT_EQ(documented.at(name).fields, layout.fields) << name;
    std::size_t end = 0;
    for (const Field& field : layout.fields) {
      EXPECT_EQ(field.offset, end) << name << "::" << field.name << " follows a gap";
      end = field.offset + field.size;
    }
    EXPECT_EQ(end, layout.size) << name;
  }
  EXPECT_EQ(documented.size(), layouts().size());
}

// ---- Rules

std::string issuesDocument() {
  static const std::map<int, std::string> kParts = {{0, "Getting at the bytes (1–99)"},
                                                    {1, "Header and contents (1xx)"},
                                                    {2, "Tables (2xx)"},
                                                    {3, "Pages (3xx)"},
                                                    {4, "Nodes (4xx)"},
                                                    {5, "Bricks (5xx)"},
                                                    {6, "Grid frames against their trees (6xx)"},
                                                    {7, "Effects (7xx)"}};
  std::string text =
      "# Every rule of a pack\n\n"
      "Generated from the catalogue in the code; see [format.md](format.md) for the rules in full. Each sentence is "
      "what\n"
      "holds in a sound pack; the issue says that it does not. Numbers are never used again for another rule. Below "
      "100\n"
      "the pack may be sound: its bytes could not be had, or a limit of the reader was met.\n";
  int part = -1;
  for (const IssueKind& kind : issueCatalogue()) {
    if (kind.id / 100 != part) {
      part = kind.id / 100;
      text += fmt::format("\n## {}\n\n| id | name | severity | rule |\n|---|---|---|---|\n", kParts.at(part));
    }
    text += fmt::format("| {} | {} | {} | {} |\n", kind.id, kind.name,
                        kind.severity == Severity::error ? "error" : "warning", kind.summary);
  }
  return text;
}

TEST(Spec, IssuesAreThoseOfTheCatalogue) {
  expectDocument("issues.md", issuesDocument());
}

TEST(Spec, CatalogueNamesAreUnique) {
  std::set<std::string_view> names;
  for (const IssueKind& kind : issueCatalogue()) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_FALSE(kind.summary.empty()) << kind.id;
  }
}

// Every rule about the pack itself is explained in format.md: its number stands in brackets there.
TEST(Spec, EveryRuleIsInTheStandard) {
  const std::string text = readSpec("format.md");
  std::set<int> cited;
  for (std::size_t at = text.find('['); at != std::string::npos; at = text.find('[', at + 1)) {
    for (std::size_t i = at + 1; i < text.size() && std::isdigit(static_cast<unsigned char>(text[i])) != 0;) {
      char* end = nullptr;
      cited.insert(static_cast<int>(std::strtol(text.c_str() + i, &end, 10)));
      i = static_cast<std::size_t>(end - text.c_str());
      if (text.compare(i, 2, ", ") == 0) i += 2;
    }
  }
  for (const IssueKind& kind : issueCatalogue()) {
    if (kind.id <= 2) continue;  // about the file, not the pack
    EXPECT_TRUE(cited.contains(kind.id)) << kind.id << " " << kind.name;
  }
}

// ---- The annotated pack

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
    return tests::getAt<T>(bytes_, at_ + offset);
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
  Dump dump(tests::smallestPack());
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
