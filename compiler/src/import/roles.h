// What a grid is for, by the names that tools give it.
#ifndef BILLOW_COMPILER_IMPORT_ROLES_H
#define BILLOW_COMPILER_IMPORT_ROLES_H

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "stages.h"

namespace billow::compiler {

// A manifest's word for a role: "extinction", "temperature", "flames", "fuel", "velocity", "color" (the latter two of a
// vec3 grid or, with X, Y, Z or R, G, B after it, of a scalar one), "none". Nullopt for any other.
std::optional<format::Role> roleByWord(std::string_view word);

// Every word that roleByWord knows, for messages.
std::string roleWords();

// The role of component c of a vec3 grid whose role is `first` (velocityX or colorR); a scalar's role otherwise.
format::Role componentRole(format::Role first, std::uint32_t component);

// Gives roles by name to the grids that have none yet. At most one grid has a role; where several names fit, the one
// that stands first in the table wins, then the first grid. A volume in which nothing would be drawn (neither
// extinction nor temperature nor flames) and that has just one scalar grid: that grid is the extinction.
// `fixed[i]` says that grid i's role was chosen by the user.
void assignRoles(std::vector<PlannedGrid>& grids, const std::vector<bool>& fixed);

}  // namespace billow::compiler

#endif  // BILLOW_COMPILER_IMPORT_ROLES_H
