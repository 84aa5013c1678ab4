// JSON files that people write: comments are allowed, duplicate keys are not, nor more than kMostLevels levels.
//
//   const json::Document document("effect.json");
//   const json::Value root = document.root();
//   root.requireKeys({"$schema", "emitters"});
//   for (const json::Value& emitter : root.at("emitters").items("a list of emitters")) {
//     emitter.requireKeys({"rate", "shape"});
//     rates.push_back(emitter.at("rate").number({0, 1e6}));
//   }
//
// and what is wrong says so: "effect.json: emitters[2].rate is -1; expected a number from 0 to 1000000".
#ifndef BILLOW_JSON_DOCUMENT_H
#define BILLOW_JSON_DOCUMENT_H

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>

#include "json/value.h"

namespace billow::json {

inline constexpr int kMostLevels = 64;  // of arrays and objects within one another

// The file cannot be read. (What is in it is wrong: json::Error, see value.h.)
class FileError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

class Document {
 public:
  // Reads and parses a file. Throws FileError; Error with the line where it is no JSON.
  explicit Document(const std::string& path);
  // The same of a text; `name` stands for it in messages.
  Document(const std::string& name, const std::string& text);
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;
  ~Document();

  // Lives as long as the document, as do all values taken out of it.
  Value root() const;

 private:
  std::string name_;
  std::unique_ptr<nlohmann::json> json_;
};

}  // namespace billow::json

#endif  // BILLOW_JSON_DOCUMENT_H
