#pragma once
// One trial of a factor of safety: the scene with its strength over F, under damping from the settled state, and what tells soil that
// holds from soil that fails. docs/stages.md has the reasons.
#include "io/file.hpp"
#include "solver/scene/check.hpp"
#include <string>
#include <vector>

namespace kuzure::safety {

/// What all trials share.
struct Setting {
    Scene base;         // without events, from `start` where it has one
    double height = 0;  // m, of the soil
    double unit = 0;    // s, in which the slowest P-wave passes through that height
    double damping = 0; // 1/s: critical for the lowest mode of the slowest soil
    double gravity = 0; // m/s^2
    double limit = 0;   // m: soil that moved farther has failed
};
/// Throws BadInput where the scene has no gravity.
Setting setting_of(Scene, const scene::Filling&, const std::string& file);

/// The scene at a time (s) of its own run, as one without events that starts from the state in `state`: what is not there by then comes
/// when no trial runs any more. Throws BadInput where a wall has been moved by then.
Scene scene_at(const Scene&, double time, const io::Path& state);

/// The scene of a trial. `start`: result directory of the state it starts from; empty: that of the base.
Scene trial_scene(const Setting&, double factor, const io::Path& start);

/// A trial is looked at after 16, 32, 64 ... units.
inline constexpr int legs = 6;
/// s since the trial began.
double end_of_leg(const Setting&, int leg);

/// What was seen at the end of a leg: of the mean of that block of soil, four spacings wide, that moved most.
struct Seen {
    double time = 0;         // s
    double displacement = 0; // m, since the trial began
    double creep = 0;        // m/s, mean of this leg
    double unbalanced = 0;   // of gravity, 1: the force that this creep needs against the damping
};
/// From the snapshots of a trial at the ends of a leg and of the one before. Throws IoFailed.
Seen inspect(const Setting&, const io::Path& results, double before, double end);

enum class Outcome { Open, Holds, Fails };
const char* word(Outcome);
/// What the legs so far say.
Outcome judge(const Setting&, const std::vector<Seen>&);
/// The criterion in sentences, for the page and safety.json.
std::vector<std::string> criterion(const Setting&);

/// Below this unbalanced force, of gravity, soil holds.
inline constexpr double at_rest = 5e-4;

} // namespace kuzure::safety
