// What is being viewed: a pack's volume or effect, or a scene, and what the panels change of it.
#ifndef BILLOW_VIEWER_DOCUMENT_H
#define BILLOW_VIEWER_DOCUMENT_H

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "render_contents.h"
#include "render_stage.h"
#include "timeline.h"

namespace billow::viewer {

using command::Checked;

// Of a pack, what to show: a volume or an effect by its name.
struct Choice {
  bool effect = false;
  std::string name;
  bool operator==(const Choice&) const = default;
};

class Document {
 public:
  // A scene (*.json), or a pack: what is chosen of it, or its first volume, or its first effect. A choice is refused
  // where the pack has none such, or the path is a scene's.
  static Checked<std::unique_ptr<Document>> open(const std::string& path, const std::optional<Choice>& choice);
  Document(const Document&) = delete;
  Document& operator=(const Document&) = delete;

  const std::string& path() const { return path_; }
  std::string name() const;  // of the file
  const std::vector<Choice>& choices() const { return choices_; }
  const Choice& choice() const { return choice_; }
  const command::Contents& contents() const { return *contents_; }
  const command::Stage& stage() const { return stage_; }
  const command::SpaceNeeds& needs() const { return needs_; }
  // "" where the direct method can draw it, else why it cannot.
  std::string whyNotDirect() const;

  // Everything of a draw but images, size and camera.
  runtime::DrawInfo describe(bool opaque) const;
  // The look of a volume without the factors of density and fire, or of the whole where there is none.
  runtime::Look lookOf(std::size_t volume) const;
  void resetLook();

  // Whether a volume has velocity grids, which advection needs.
  bool hasVelocity() const;

  // As opened anew with what the request now says, or the packs: grids, ticks and extent, but for where the time line
  // is. What cannot be found leaves all as it was.
  Checked<void> renew();

  // What the panels change; no volume and no effect is added or taken away.
  command::RenderRequest request;
  std::unique_ptr<Timeline> timeline;

 private:
  Document() = default;
  Checked<void> find();

  std::string path_;
  std::vector<Choice> choices_;
  Choice choice_;
  command::RenderRequest original_;
  std::optional<command::Contents> contents_;
  command::Stage stage_{};
  command::SpaceNeeds needs_;
};

// Members of a scene file that draw as the document now does, but for the packs and their frames: sun, look, exposure
// and voxel size. `volume` is the one whose look is told where the scene has several.
std::string sceneMembers(const Document& document, std::size_t volume);

}  // namespace billow::viewer

#endif  // BILLOW_VIEWER_DOCUMENT_H
