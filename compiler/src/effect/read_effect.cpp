#include <fmt/format.h>

#include <set>

#include "effect/read.h"
#include "import/input_notes.h"
#include "json/document.h"
#include "stages.h"

namespace billow::compiler {
namespace {

using json::Value;

void readFlags(const Value& root, EffectDescription& effect) {
  const auto loop = root.find("loop"), warm = root.find("prewarm");
  if (loop && loop->boolean()) effect.flags |= format::kEffectLoop;
  if (!warm || !warm->boolean()) return;
  if (effect.flags == 0) warm->fail("\"loop\": true beside it");
  effect.flags |= format::kEffectPrewarm;
}

// By the bound that the format itself holds an effect to.
void checkAlive(const Value& root, const EffectDescription& effect) {
  std::uint64_t alive = 0;
  for (const EmitterDescription& emitter : effect.emitters) {
    alive += emitter.given ? format::mostAlive(emitter.given->particles, effect.duration, effect.flags != 0)
                           : format::mostAlive(emitter.record, emitter.spans, effect.duration, effect.flags != 0);
  }
  if (alive <= format::kMaxAlive) return;
  throw json::Error(
      fmt::format("{}: {} particles may be alive at once; expected at most {}: lower rate, bursts or lifetime, or "
                  "take fewer from files",
                  root.place(), alive, format::kMaxAlive));
}

EffectDescription readRoot(const Value& root, const std::filesystem::path& folder) {
  root.requireKeys({"$schema", "name", "seed", "duration", "loop", "prewarm", "emitters"});
  EffectDescription effect;
  effect.name = root.at("name").name("an effect's name");
  if (const auto seed = root.find("seed")) effect.seed = static_cast<std::uint32_t>(seed->integer(0, 0xffffffff));
  effect.duration = root.at("duration")
                        .single({static_cast<double>(format::kMinDuration), static_cast<double>(format::kMaxDuration)});
  readFlags(root, effect);
  const Value list = root.at("emitters");
  const auto emitters = list.items("a list of emitters");
  if (emitters.size() > format::kMaxEmitters) list.fail(fmt::format("at most {} emitters", format::kMaxEmitters));
  std::set<std::string> names;
  for (const Value& emitter : emitters) {
    effect.emitters.push_back(readEmitter(emitter, effect, folder));
    if (!names.insert(effect.emitters.back().name).second) emitter.at("name").fail("a name that no other emitter has");
  }
  checkAlive(root, effect);
  return effect;
}

}  // namespace

EffectDescription readEffect(const std::string& path) {
  try {
    noteInput(path);
    const json::Document document(path);
    EffectDescription effect = readRoot(document.root(), std::filesystem::path(path).parent_path());
    effect.file = path;
    return effect;
  } catch (const json::FileError& error) {
    throw Error(Fault::file, error.what());
  } catch (const json::Error& error) {
    throw Error(Fault::input, error.what());
  }
}

}  // namespace billow::compiler
