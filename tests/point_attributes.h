// The attributes of particles in files that are asked for where a description names none.
#ifndef BILLOW_TESTS_POINT_ATTRIBUTES_H
#define BILLOW_TESTS_POINT_ATTRIBUTES_H

#include "import/points.h"

namespace billow::tests {

inline compiler::PointAttributes usualAttributes() {
  compiler::PointAttributes attributes;
  attributes.id = {{"id"}, false};
  attributes.radius = {{"pscale", "radius"}, false};
  attributes.age = {{"age"}, false};
  attributes.life = {{"life"}, false};
  attributes.colour = {{"", "Cd"}, false};
  return attributes;
}

}  // namespace billow::tests

#endif  // BILLOW_TESTS_POINT_ATTRIBUTES_H
