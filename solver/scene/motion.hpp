#pragma once
// Walls that events move. Where one stands follows from the scene, the number of events that have begun and the time alone.
#include "solver/scene/issue.hpp"
#include "solver/scene/pose.hpp"
#include "solver/scene/scene.hpp"
#include "solver/scene/shape.hpp"

namespace kuzure::scene {

/// True where some event moves a wall, ever.
bool moves(const Scene&, int wall);
bool any_wall_moves(const Scene&);
/// True where some event moves, adds or removes a wall.
bool walls_change(const Scene&);
/// Numbers of the walls that some event moves.
std::vector<int> moving_walls(const Scene&);

/// Where a wall stands at `time` (s) once the first `begun` events of their order have begun.
Pose pose_at(const Scene&, int wall, int begun, double time);
/// The farthest way (m) of any point of a shape from one pose to another.
double farthest_way(const Shape&, const Pose&, const Pose&);
/// The largest speed of any wall as an event that moves it begins, m/s; 0 where none does.
double fastest_wall(const Scene&);

/// Distance (m, negative inside) and outward normal, as the wall stands now.
Contact contact(const Wall&, Vector x, int dimensions);
inline double signed_distance(const Wall& w, Vector x, int dimensions) { return contact(w, x, dimensions).distance; }
/// The smallest box around a wall as it stands now.
Box bounds(const Wall&);

/// What is wrong with one event's move; `key` is the event's.
void check_move(const Scene&, const Event&, const std::string& key, Issues&);

} // namespace kuzure::scene
