// Descriptions of effects for tests, as JSON to be changed at will.
#ifndef BILLOW_TESTS_EFFECT_DOCUMENT_H
#define BILLOW_TESTS_EFFECT_DOCUMENT_H

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "effect/bake_effect.h"
#include "effect/read.h"

namespace billow::tests {

class EffectFile {
 public:
  explicit EffectFile(const std::string& text) {
    path_ = (std::filesystem::temp_directory_path() / ("billow_effect_" + std::to_string(::getpid()) + ".effect.json"))
                .string();
    std::ofstream(path_) << text;
  }
  EffectFile(const EffectFile&) = delete;
  EffectFile& operator=(const EffectFile&) = delete;
  ~EffectFile() { std::filesystem::remove(path_); }
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

inline nlohmann::json smallest() {
  return nlohmann::json::parse(R"({"name": "test", "duration": 2, "emitters": [{
    "name": "puffs", "rate": 10, "lifetime": 1,
    "primitive": {"kind": "sphere", "radius": 1, "density": {"extinction": 2}}}]})");
}

inline compiler::EffectDescription readDocument(const nlohmann::json& document) {
  return compiler::readEffect(EffectFile(document.dump()).path());
}

inline format::PackTables bake(const nlohmann::json& document) {
  format::PackTables tables;
  const compiler::EffectDescription effect = readDocument(document);
  compiler::bakeEffects({&effect, 1}, tables);
  return tables;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_EFFECT_DOCUMENT_H
