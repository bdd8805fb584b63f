#pragma once
// Events: in which order a scene changes while it runs, and what it is at a time. A stage is a function of the scene, of how many events
// have begun and of the time alone, so that a restart makes it anew.
#include "solver/scene/fill.hpp"
#include "solver/scene/issue.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure::scene {

/// Of a record at a time, s: straight between two rows, beyond the first and the last as there.
Vector value_at(const Record&, double time);
/// When an event begins and when all of it has happened, s; ground motion lasts as long as its record.
double begin_of(const Event&);
double end_of(const Event&);
/// True where something goes on after an event has begun.
bool lasting(const Event&);
/// True where, beside walls that move, something changes little by little.
bool has_course(const Event&);
/// Numbers of the events in the order in which they begin, those of one time as in the file.
std::vector<int> order_of_events(const Scene&);
/// The first time after `time` (s) at which an event begins or ends; infinite where there is none.
double next_event_after(const Scene&, double time);

/// The scene at `time` (s) once the first `begun` events of their order have begun. `start`: the scene at its start.
Scene stage_of(const Scene& start, int begun, double time);
/// Number of the body, wall or load with a name; -1 where there is none.
int body_named(const Scene&, const std::string& name);
int wall_named(const Scene&, const std::string& name);
int load_named(const Scene&, const std::string& name);
/// Puts it there, or takes it away.
void set_present(Scene&, const std::string& name, bool there);
/// Bodies, walls and loads that an event adds before one removes them are not there at the start.
void resolve_presence(Scene&);
/// Times (s) from which and to which a body, wall or load of this name is there; all time where it has none.
std::vector<std::array<double, 2>> presence(const Scene&, const std::string& name);

/// Soil particles of the bodies that are present.
std::int64_t soil_present(const Scene&, const Filling&);
/// "wall gate" or "wall 2", "body lift" or "body 0", "load footing" or "load 1".
std::string name_of_wall(const Scene&, int wall);
std::string name_of_body(const Scene&, int body);
std::string name_of_load(const Scene&, int load);
/// "at t = 2 s", "from t = 2 s to 3 s".
std::string time_in_words(const Event&);
/// "wall gate is removed; soil clay: cohesion 500 Pa".
std::string in_words(const Scene&, const Event&);

/// Names that are not unique, unknown or wrong; events that say nothing, contradict one another, or come when they cannot. What follows
/// of a stage's numbers is judged by check().
void check_names_and_events(const Scene&, Issues&);

} // namespace kuzure::scene
