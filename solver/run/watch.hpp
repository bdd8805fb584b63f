#pragma once
// The guard: watches a run for what cannot be right, every step and at list rebuilds, and says which limit broke, where and why.
#include "solver/run/clock.hpp"
#include "solver/run/layout.hpp"
#include "solver/scene/fill.hpp"
#include "solver/scene/material.hpp"
#include "solver/scene/scene.hpp"
#include <string>

namespace kuzure {

/// Limits beyond which the numbers cannot be trusted.
namespace limit {
inline constexpr double energy_growth = 0.10; // of the largest energy in the ledger
inline constexpr double given = 1e-3;         // of the largest energy met: what fixed walls may have given, and dissipations lost again
inline constexpr double neighbours = 3.0;     // times those of the lattice
inline constexpr double penetration = 1.0;    // spacings that a particle may sink into a wall
inline constexpr double in_new_piece = 0.5;   // spacings that soil may lie inside a wall or body that an event adds
inline constexpr double density = 10.0;       // times or parts of that at the start
inline constexpr double near = 0.6;           // spacings below which two particles count as clumped
} // namespace limit

/// What an inspection of the neighbourhoods finds; the worst particle of each kind by its id, -1 if none. The same on
/// every rank after combine().
struct Neighbourhoods {
    double clumped = 0;         // share of particles whose nearest soil neighbour is nearer than limit::near spacings
    double most_neighbours = 0; // of one particle, over that of the lattice
    double deepest = 0;         // spacings below a wall's surface
    std::int64_t crowded_id = -1, sunk_id = -1;
};

/// Collective. Looks at every particle's neighbours where the lists were built.
Neighbourhoods inspect_neighbours(const Team&, const Scene&, std::int64_t soil_count, const Particles&, const Layout&);

class Watch {
public:
    /// All of them must outlive it.
    Watch(const Comm&, const Scene&, const scene::Filling&, std::span<const Material>);

    /// The limits of every step. Throws NumbersFailed on every rank together.
    void judge_step(const Particles&, const Clock&);
    /// Energies and neighbourhoods, after a list rebuild. Collective. Throws NumbersFailed on every rank together.
    void inspect(const Particles&, const Layout&, Clock&, const Ledger&);

    /// Shares of clumped particles, and the deepest in a wall (spacings), as last seen and at their worst.
    struct Seen {
        double clumped = 0, most_clumped = 0, deepest = 0;
    };
    const Seen& seen() const { return seen_; }
    /// Id of the particle that the last NumbersFailed named; -1 before there was one.
    std::int64_t failed_id() const { return failed_id_; }

private:
    /// Throws NumbersFailed with what happened to this particle, where, and the remedy.
    [[noreturn]] void fail_at(const Particles&, const Clock&, std::int64_t id, const std::string& what, const std::string& remedy);
    /// Fixed walls give no energy, and dissipations do not fall. Throws NumbersFailed.
    void judge_ledger(const Particles&, Clock&, const Ledger&);
    /// No soil is where there is no ground. Collective. Throws NumbersFailed.
    void judge_edge(const Particles&, const Clock&);
    /// "wall 2", the one nearest to a particle.
    std::string nearest_wall(const Particles&, std::int64_t id) const;
    /// Id of the fastest particle, the lowest of several.
    std::int64_t fastest(const Particles&) const;
    /// Which limit of stability the present step breaks, and what to do: {what, remedy}.
    std::pair<std::string, std::string> diagnosis(const Clock&) const;

    const Comm& comm_;
    const Scene& scene_;
    const scene::Filling& filling_;
    std::span<const Material> soils_;
    Seen seen_;
    std::int64_t failed_id_ = -1;
};

} // namespace kuzure
