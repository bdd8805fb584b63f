#pragma once
// A checkpoint against the scene it is to go on with: right checksums tell that it is as it was written, not that it makes sense.
#include "decomposition/comm.hpp"
#include "io/checkpoint.hpp"
#include "solver/core/particles.hpp"
#include "solver/run/clock.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/scene.hpp"

namespace kuzure {

/// Collective. The particles as read: as many as the scene has at this time, each id once, soils and activities that there are, every
/// number of every field finite, densities above 0, positions inside the box. Throws IoFailed on all ranks: the file, and
/// what is wrong.
void require_sound_state(const Comm&, const io::Checkpoint&, const Particles&, const Scene&, const scene::Filling&, const Clock&);

/// Collective. Throws IoFailed where `now` has a field that was not among those read: it would be zeros.
void require_fields(const Comm&, const io::Checkpoint&, const std::vector<std::string_view>& read, const Particles& now);
/// The names of the fields that are present.
std::vector<std::string_view> field_names(const Particles&);

} // namespace kuzure
