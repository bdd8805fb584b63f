#pragma once
// What soil does to the named walls: force, moment and impulse, from the very accelerations that the walls give to the soil.
#include "solver/run/clock.hpp"
#include "solver/run/layout.hpp"
#include "solver/scene/material.hpp"
#include "solver/walls/surface.hpp"

namespace kuzure {

/// On one wall, since the start and now; in 2-D per metre of thickness.
struct WallLoad {
    std::string name;
    Vector force;   // N
    Vector moment;  // N m, about the scene's origin
    Vector impulse; // N s, since the start
};

class WallForces {
public:
    /// All of them must outlive it. `energy_unit` (J) is the run's.
    WallForces(const Scene&, std::span<const Material>, const Layout&);
    /// The walls of the scene that have names, in its order; none where the scheme does not tell their forces.
    static std::vector<int> named(const Scene&);
    bool any() const { return !walls_.empty(); }
    /// The faces behind which the wall points lie, where the walls near this rank are other ones than before. Call it after lists were
    /// made, with the walls of the scene as they stood then.
    void renew_faces();
    /// Adds what the present forces do in so many seconds on this rank; false where it outgrows its unit.
    bool add_impulse(const Particles&, double seconds, Clock&);
    /// Collective. `impulse` as in the clock of this rank.
    std::vector<WallLoad> loads(const Team&, const Particles&, const Clock&);

    std::size_t bytes() const
    {
        std::size_t b = 0;
        for (const auto& f : faces_) b += f.bytes();
        return b;
    }

private:
    struct Seen;
    /// visit(number in walls_, position, force on the wall) for every particle of a cluster and every named wall in its reach.
    template <class Visit> void for_each_force(const Particles&, Index cluster, Visit visit) const;
    /// A particle in reach of several walls is shared among them by what its stress does to the faces of each, as the pair loop has it; the
    /// remainder, of viscosity and friction, by how much it sees of each and which way that can bear.
    template <class Visit> void share(std::span<const Seen>, Vector x, Vector force, Visit visit) const;
    /// Adds what a particle at x sees of one wall point.
    void see(Index wall, Index point, Vector x, const Stress&, std::vector<Seen>&) const;
    /// A face of a point that was at `then` when lists were made and is at `now`, m.
    Face face_of_now(const Face&, Vector then, Vector now) const;
    /// Walls that move are where the scene has them now.
    void place_walls();
    double impulse_unit(const Clock&) const;

    const Scene& scene_;
    std::span<const Material> soils_;
    const Layout& layout_;
    std::vector<int> walls_;                        // those with names
    std::vector<int> number_of_;                    // of each wall in walls_, -1 for one without a name
    std::vector<PointFaces> faces_;                 // of each wall
    std::vector<scene::Pose> poses_;                // of each wall, for which faces_ are
    std::vector<std::optional<scene::Pose>> since_; // of each wall that has moved since
    std::vector<bool> own_faces_;                   // of each wall: none of its points stands behind a face of another
    std::int64_t faces_of_ = -1;                    // Layout::wall_renewals() for which they are
};

} // namespace kuzure
