#include "import/roles.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <set>

namespace billow::compiler {
namespace {

using format::Role;

struct Alias {
  Role role;
  std::string_view name;  // lower case
};

// By preference within a role. Mantaflow writes the upsampled simulation as *_noise beside the base, and Blender draws
// the noise where it is there. EmberGen: density, temperature, flames, fuel, velocity. Houdini's pyro: density,
// temperature, flame, heat, burn, fuel, vel, Cd. Blender's Cycles: density, flame, heat, temperature, color, velocity.
constexpr Alias kScalarAliases[] = {
    {Role::extinction, "density_noise"},
    {Role::extinction, "density"},
    {Role::extinction, "smoke"},
    {Role::extinction, "soot"},
    {Role::extinction, "fog"},
    {Role::extinction, "dens"},
    {Role::extinction, "dust"},
    {Role::extinction, "cloud"},
    {Role::extinction, "clouds"},
    {Role::extinction, "extinction"},
    {Role::extinction, "steam"},
    {Role::temperature, "temperature_noise"},
    {Role::temperature, "temperature"},
    {Role::temperature, "temp"},
    {Role::temperature, "heat_noise"},
    {Role::temperature, "heat"},
    {Role::flames, "flame_noise"},
    {Role::flames, "flames"},
    {Role::flames, "flame"},
    {Role::flames, "fire"},
    {Role::flames, "burn"},
    {Role::flames, "emission"},
    {Role::fuel, "fuel_noise"},
    {Role::fuel, "fuel"},
    {Role::velocityX, "velocity_x"},
    {Role::velocityX, "vel_x"},
    {Role::velocityX, "velocity.x"},
    {Role::velocityX, "vel.x"},
    {Role::velocityX, "velx"},
    {Role::velocityY, "velocity_y"},
    {Role::velocityY, "vel_y"},
    {Role::velocityY, "velocity.y"},
    {Role::velocityY, "vel.y"},
    {Role::velocityY, "vely"},
    {Role::velocityZ, "velocity_z"},
    {Role::velocityZ, "vel_z"},
    {Role::velocityZ, "velocity.z"},
    {Role::velocityZ, "vel.z"},
    {Role::velocityZ, "velz"},
    {Role::colorR, "color_r"},
    {Role::colorR, "color_r_noise"},
    {Role::colorR, "cd.r"},
    {Role::colorG, "color_g"},
    {Role::colorG, "color_g_noise"},
    {Role::colorG, "cd.g"},
    {Role::colorB, "color_b"},
    {Role::colorB, "color_b_noise"},
    {Role::colorB, "cd.b"},
};

// Names of vec3 grids; the role of their x component.
constexpr Alias kVectorAliases[] = {
    {Role::velocityX, "velocity"}, {Role::velocityX, "vel"}, {Role::velocityX, "v"},    {Role::colorR, "color"},
    {Role::colorR, "colour"},      {Role::colorR, "cd"},     {Role::colorR, "diffuse"}, {Role::colorR, "albedo"},
};

constexpr std::array<std::pair<std::string_view, Role>, 13> kWords{{
    {"none", Role::none},
    {"extinction", Role::extinction},
    {"temperature", Role::temperature},
    {"flames", Role::flames},
    {"fuel", Role::fuel},
    {"velocity", Role::velocityX},
    {"velocityX", Role::velocityX},
    {"velocityY", Role::velocityY},
    {"velocityZ", Role::velocityZ},
    {"color", Role::colorR},
    {"colorR", Role::colorR},
    {"colorG", Role::colorG},
    {"colorB", Role::colorB},
}};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

bool scalar(const PlannedGrid& grid) {
  return grid.component == format::kNone;
}

// What an alias is matched with: the grid's own name, without the component's suffix.
std::string baseName(const PlannedGrid& grid) {
  return lower(scalar(grid) ? grid.name : grid.name.substr(0, grid.name.size() - 2));
}

}  // namespace

std::optional<Role> roleByWord(std::string_view word) {
  for (const auto& [known, role] : kWords) {
    if (known == word) return role;
  }
  return std::nullopt;
}

std::string roleWords() {
  std::vector<std::string_view> words;
  words.reserve(kWords.size());
  for (const auto& [known, role] : kWords) words.push_back(known);
  return fmt::format("{}", fmt::join(words, ", "));
}

Role componentRole(Role first, std::uint32_t component) {
  if (component == format::kNone || (first != Role::velocityX && first != Role::colorR)) return first;
  return static_cast<Role>(static_cast<std::uint32_t>(first) + component);
}

void assignRoles(std::vector<PlannedGrid>& grids, const std::vector<bool>& fixed) {
  std::set<Role> taken;
  for (const PlannedGrid& grid : grids) taken.insert(grid.role);
  const auto give = [&](const Alias& alias, bool vectors) {
    for (std::size_t i = 0; i < grids.size(); ++i) {
      PlannedGrid& grid = grids[i];
      if (fixed[i] || grid.role != Role::none || scalar(grid) == vectors || baseName(grid) != alias.name) continue;
      const Role role = componentRole(alias.role, grid.component);
      if (taken.insert(role).second) grid.role = role;
    }
  };
  for (const Alias& alias : kVectorAliases) give(alias, true);
  for (const Alias& alias : kScalarAliases) give(alias, false);
  if (taken.count(Role::extinction) + taken.count(Role::temperature) + taken.count(Role::flames) > 0) return;
  if (std::count_if(grids.begin(), grids.end(), scalar) != 1) return;
  const auto only = std::find_if(grids.begin(), grids.end(), scalar);
  if (only->role == Role::none && !fixed[static_cast<std::size_t>(only - grids.begin())]) only->role = Role::extinction;
}

}  // namespace billow::compiler
