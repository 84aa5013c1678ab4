// What people write as JSON, right and wrong: every complaint names place, value and what was expected.
#include <gtest/gtest.h>

#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

#include "billow/format/look.h"
#include "billow/format/source.h"
#include "json/document.h"
#include "json/look.h"
#include "unit/run_command.h"

namespace billow::json {
namespace {

using Use = std::function<void(const Value&)>;

// What reading `text` and then `use` complain of; "" if they don't.
std::string complaint(
    const std::string& text, const Use& use = [](const Value&) {}) {
  try {
    const Document document("e.json", text);
    use(document.root());
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

TEST(JsonDocument, TakesComments) {
  EXPECT_EQ(complaint("// a line\n{\"a\": /* within */ 1}"), "");
}

TEST(JsonDocument, NamesTheLineWhereItIsNoJson) {
  EXPECT_EQ(complaint("{\n\"a\": 1,\n}").substr(0, 25), "e.json: not JSON: line 3,");
  EXPECT_NE(complaint(""), "");
  EXPECT_NE(complaint("{} {}"), "");
  EXPECT_NE(complaint("\"\xff\""), "");
  EXPECT_NE(complaint("[1e999]").find("1e999"), std::string::npos);
}

TEST(JsonDocument, RefusesAKeyThatComesTwice) {
  EXPECT_EQ(complaint(R"({"a": 1, "a": 1})"), "e.json: a is there twice; expected each key once");
  EXPECT_EQ(complaint(R"({"list": [0, [], {}, {"x": {"k": 1, "b": [], "k": 2}}]})"),
            "e.json: list[3].x.k is there twice; expected each key once");
  EXPECT_EQ(complaint(R"({"a": {"k": 1}, "b": {"k": 1}, "c": [{"k": 1}, {"k": 1}]})"), "");
}

// nlohmann's own writing of a value follows its depth on the stack.
TEST(JsonDocument, RefusesEndlessDepth) {
  const auto nested = [](std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); };
  EXPECT_EQ(complaint(nested(kMostLevels)), "");
  EXPECT_NE(complaint(nested(kMostLevels + 1)).find("expected at most 64 levels"), std::string::npos);
  EXPECT_NE(complaint(nested(1000000)).find("lies too deep"), std::string::npos);
  EXPECT_NE(complaint(std::string(1000000, '[')).find("lies too deep"), std::string::npos);
}

// Whatever the bytes, a value or one line.
TEST(JsonDocument, TakesAnyBytes) {
  const std::string whole =
      R"({"a": [1, -2.5e3, true, null], /* c */ "b\u00e4": {"k": "text", "l": {}}, "look": [[]]})";
  std::mt19937 random(1);
  int reached = 0;
  for (int round = 0; round < 3000; ++round) {
    std::string text = whole.substr(0, random() % 4 == 0 ? random() % whole.size() : whole.size());
    for (std::uint32_t i = 0; i < random() % 3 && !text.empty(); ++i) {
      text[random() % text.size()] = static_cast<char>(random());
    }
    const std::string told = complaint(text, [](const Value& root) {
      root.requireKeys({"a", "b", "look"});
      for (const Value& item : root.at("a").items("a list")) (void)item.single({-1e9, 1e9});
    });
    EXPECT_EQ(told.find('\n'), std::string::npos) << told;
    EXPECT_TRUE(told.empty() || told.starts_with("e.json: ")) << told;
    reached += told.find("b\\u00e4") != std::string::npos ? 1 : 0;
  }
  EXPECT_GT(reached, 100) << "most texts must get as far as their keys";
}

TEST(JsonDocument, ReadsFiles) {
  const tests::TempFolder folder;
  std::ofstream(folder / "a.json") << "[1]";
  EXPECT_EQ(Document(folder / "a.json").root().items("numbers").size(), 1u);
  EXPECT_THROW(Document(folder / "b.json"), FileError);
  EXPECT_THROW(Document(folder.path().string()), FileError);
  std::ofstream(folder / "large.json") << "[]";
  std::filesystem::resize_file(folder / "large.json", format::kMostTextBytes + 1);
  EXPECT_THROW(Document(folder / "large.json"), FileError);
}

TEST(JsonValue, KnowsItsPlace) {
  const Document document("e.json", R"({"emitters": [{}, {"a rate": {"x.y": 3, "": 4}}]})");
  const Value inner = document.root().at("emitters").items("a list")[1].at("a rate");
  EXPECT_EQ(document.root().path(), "");
  EXPECT_EQ(inner.path(), R"(emitters[1]["a rate"])");
  EXPECT_EQ(inner.at("x.y").path(), R"(emitters[1]["a rate"]["x.y"])");
  EXPECT_EQ(inner.at("").path(), R"(emitters[1]["a rate"][""])");
  EXPECT_EQ(inner.place(), R"(e.json: emitters[1]["a rate"])");
}

TEST(JsonValue, ProposesTheNearestOfTheKnownKeys) {
  const Use use = [](const Value& root) { root.requireKeys({"name", "fps", "inputs"}); };
  EXPECT_EQ(complaint(R"({"name": 1, "fps": 2})", use), "");
  EXPECT_EQ(complaint(R"({"fsp": 2})", use),
            "e.json: fsp is not known (did you mean \"fps\"?); expected one of name, fps, inputs");
  EXPECT_EQ(complaint(R"({"Input": 2})", use),
            "e.json: Input is not known (did you mean \"inputs\"?); expected one of name, fps, inputs");
  EXPECT_EQ(complaint(R"({"colour": 2})", use), "e.json: colour is not known; expected one of name, fps, inputs");
  EXPECT_EQ(complaint("[]", use), "e.json: the document is []; expected an object");
  EXPECT_NE(complaint("{\"" + std::string(1 << 20, 'x') + "\": 2}", use), "");
}

TEST(JsonValue, MissesWhatIsNotThere) {
  EXPECT_EQ(complaint(R"({"a": {}})", [](const Value& root) { root.at("a").at("b"); }), "e.json: a.b is missing");
  EXPECT_EQ(complaint(R"({"a": {}})", [](const Value& root) { EXPECT_FALSE(root.at("a").find("b")); }), "");
  EXPECT_EQ(complaint(R"({"a": 3})", [](const Value& root) { root.at("a").find("b"); }),
            "e.json: a is 3; expected an object");
}

TEST(JsonValue, TakesNumbersInTheirRange) {
  const auto number = [](const char* text, const Range& range) {
    return complaint(text, [&](const Value& root) { EXPECT_EQ(root.number(range), root.number(range)); });
  };
  EXPECT_EQ(number("0", {0, 1}), "");
  EXPECT_EQ(number("1", {0, 1}), "");
  EXPECT_EQ(number("-0.5", {0, 1}), "e.json: the document is -0.5; expected a number from 0 to 1");
  EXPECT_EQ(number("1", {0, 1, true}), "e.json: the document is 1; expected a number between 0 and 1");
  EXPECT_EQ(number("\"1\"", {0, 1}), "e.json: the document is \"1\"; expected a number from 0 to 1");
  EXPECT_EQ(number("18446744073709551615", {0, 1e6}),
            "e.json: the document is 18446744073709551615; expected a number from 0 to 1000000");
}

TEST(JsonValue, RoundsToSinglePrecisionWithinTheRange) {
  const auto single = [](const char* text, const Range& range) {
    return complaint(text, [&](const Value& root) { EXPECT_TRUE(std::isfinite(root.single(range))); });
  };
  constexpr double kMost = std::numeric_limits<float>::max();
  EXPECT_EQ(single("3.4028234663852886e38", {0, kMost}), "");
  EXPECT_NE(single("3.4028234663852890e38", {0, kMost}), "");
  EXPECT_NE(single("1e300", {0, kMost}), "");
  EXPECT_EQ(single("0.001", {0.001, 1}), "");
  EXPECT_NE(single("0.99999999999", {-1, 1, true}), "");  // single precision takes it for 1
}

TEST(JsonValue, TakesWholeNumbers) {
  const auto integer = [](const char* text, std::int64_t low, std::int64_t high) {
    return complaint(text, [&](const Value& root) { (void)root.integer(low, high); });
  };
  EXPECT_EQ(integer("-3", -3, 8), "");
  EXPECT_EQ(integer("9", 1, 8), "e.json: the document is 9; expected a whole number from 1 to 8");
  EXPECT_NE(integer("1.0", 1, 8), "");
  EXPECT_NE(integer("18446744073709551615", -1, 8), "");
  EXPECT_NE(integer("true", 0, 8), "");
}

TEST(JsonValue, TakesListsWordsAndTexts) {
  const Document document("e.json", R"({"v": [1, 2, 3], "w": "b", "t": "x", "f": false})");
  const Value root = document.root();
  EXPECT_EQ(root.at("v").numbers<3>({0, 5}), (std::array<double, 3>{1, 2, 3}));
  EXPECT_EQ(root.at("v").singles<3>({0, 5}), (std::array<float, 3>{1, 2, 3}));
  EXPECT_EQ(root.at("w").word({"a", "b"}), 1u);
  EXPECT_EQ(root.at("t").text("a text"), "x");
  EXPECT_FALSE(root.at("f").boolean());
  const auto wrong = [](const char* text, const Use& use) { return complaint(text, use); };
  EXPECT_EQ(wrong("[1, 9, 3]",
                  [](const Value& v) {
                    (void)v.numbers<3>({0, 5});
                  }),
            "e.json: [1] is 9; expected a number from 0 to 5");
  EXPECT_EQ(wrong("[1, 2]",
                  [](const Value& v) {
                    (void)v.numbers<3>({0, 5});
                  }),
            "e.json: the document is [1,2]; expected a list of 3 numbers");
  EXPECT_EQ(wrong("[]", [](const Value& v) { (void)v.items("a list of grids"); }),
            "e.json: the document is []; expected a list of grids");
  EXPECT_EQ(wrong("\"c\"",
                  [](const Value& v) {
                    (void)v.word({"a", "b"});
                  }),
            "e.json: the document is \"c\"; expected \"a\" or \"b\"");
  EXPECT_NE(wrong("\"\"", [](const Value& v) { (void)v.text("a text"); }), "");
  EXPECT_NE(wrong("\"a\\n\"", [](const Value& v) { (void)v.name("a name"); }), "");
  EXPECT_NE(wrong("1", [](const Value& v) { (void)v.boolean(); }), "");
}

TEST(JsonValue, ShowsTheBeginningOfWhatIsLong) {
  const std::string told =
      complaint("[" + std::string(100000, '1') + "e-99999, \"\xc3\xa4\"]", [](const Value& v) { v.fail("less"); });
  EXPECT_LT(told.size(), 120u);
  EXPECT_NE(told.find("; expected less"), std::string::npos);
}

TEST(JsonLook, TakesWhatAPackHolds) {
  const Document document("e.json", R"({"emissionScale": 2, "albedo": [0.5, 1, 0], "density": 3})");
  const format::LookRecord look = readLook(document.root(), {"density"});
  EXPECT_EQ(look.set, 1u << format::kLookEmissionScale | 1u << format::kLookAlbedo);
  EXPECT_EQ(look.emissionScale, 2);
  EXPECT_EQ(look.albedo[1], 1);
  EXPECT_EQ(look.extinctionScale, 0);
  EXPECT_NE(complaint(R"({"density": 3})", [](const Value& v) { (void)readLook(v); }), "");
  EXPECT_EQ(complaint(R"({"albedo": [0, 2, 0]})", [](const Value& v) { (void)readLook(v); }),
            "e.json: albedo[1] is 2; expected a number from 0 to 1");
  EXPECT_EQ(complaint(R"({"anisotropy": 1})", [](const Value& v) { (void)readLook(v); }),
            "e.json: anisotropy is 1; expected a number between -1 and 1");
}

// The numbers that a schema allows: its own, or those of the definition that it refers to.
nlohmann::json boundsIn(const nlohmann::json& schema, const nlohmann::json& property) {
  if (property.contains("$ref")) {
    const auto at = nlohmann::json::json_pointer(property["$ref"].get<std::string>().substr(1));
    return boundsIn(schema, schema.at(at));
  }
  return property.contains("items") ? property["items"] : property;
}

TEST(JsonLook, IsBoundedAsTheSchemasSay) {
  const std::string spec = std::string(BILLOW_SOURCE_DIR) + "/spec/";
  const auto manifest = nlohmann::json::parse(tests::readFile(spec + "manifest.schema.json"));
  const auto scene = nlohmann::json::parse(tests::readFile(spec + "scene.schema.json"));
  for (const format::LookField& field : format::kLookFields) {
    const std::string name(field.name);
    for (const auto& [schema, look] : {std::pair{manifest, manifest["definitions"]["look"]["properties"]},
                                       std::pair{scene, scene["$defs"]["look"]["properties"]}}) {
      const auto bounds = boundsIn(schema, look.at(name));
      EXPECT_EQ(bounds.at(field.open ? "exclusiveMinimum" : "minimum").get<double>(), double{field.low}) << name;
      EXPECT_EQ(bounds.at(field.open ? "exclusiveMaximum" : "maximum").get<double>(), double{field.high}) << name;
    }
  }
}

}  // namespace
}  // namespace billow::json
