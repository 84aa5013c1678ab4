// A brick of the corpus as the encoders take it.
#ifndef BILLOW_TESTS_BRICK_SOURCE_H
#define BILLOW_TESTS_BRICK_SOURCE_H

#include "brick_corpus.h"
#include "stages.h"

namespace billow::tests {

inline constexpr float kTile = -77.0f;  // no value of a corpus brick

// `tile` is what inactive voxels become.
inline compiler::BrickSource sourceOf(const Brick& brick, float tile = kTile) {
  return {&brick.values, &brick.active, brick.activeCount, tile};
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_BRICK_SOURCE_H
