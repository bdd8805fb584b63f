#pragma once
// The walls of a scene as one surface: the boundary of the union of all their shapes and of their images across the periods. A
// face that another wall covers or continues is no surface. How the same ground is divided or joined does not show.
#include "solver/scene/scene.hpp"
#include <span>
#include <vector>

namespace kuzure {

/// The tangent plane of the surface nearest to a point inside a wall: the points x with (x - point).normal = depth.
struct Face {
    Vector normal; // out of the wall
    double depth;  // m
    int wall;      // whose contact counts
    Vector side;   // normal of that wall's own face: at an edge, where another wall goes on, not the tangent plane's
    /// Where it touches the surface, seen from the point x, m.
    Vector foot(Vector x) const { return x + depth * normal; }
};
/// What of a force on a face the wall of the face feels; the remainder is felt by the wall of the point behind it, if that is another.
inline Vector own_share(const Face& f, Vector force) { return dot(f.side, f.normal) > 1 - 1e-9 ? force : dot(force, f.side) * f.side; }
/// Velocity of a face from those of walls, velocity(wall, point); x: the point behind it, of the wall `own`. At an edge between two walls
/// each counts the way in which it feels the force.
template <class Velocity> Vector velocity_of(const Face& f, int own, Vector x, Velocity velocity)
{
    const Vector foot = f.foot(x), v = velocity(f.wall, foot);
    if (own == f.wall) return v;
    const Vector other = velocity(own, foot);
    return own_share(f, v) + (other - own_share(f, other));
}

class WallSurface {
public:
    /// The walls of the scene, which must outlive it.
    explicit WallSurface(const Scene&);
    /// Exposed faces no further than `reach` from a point inside a wall, nearest first; several where the wall is thin or the point
    /// lies behind a corner.
    void faces(Vector point, double reach, std::vector<Face>& found) const;
    /// Depth of a point below the surface, m; 0 outside all walls.
    double depth(Vector point, double reach) const;

private:
    struct Part {
        int wall;
        Vector shift; // of this image, m
        scene::Box bounds;
        bool moved; // it is not as drawn
    };
    /// A point of space as the part's shape is drawn, m.
    Vector as_drawn(const Part&, Vector x) const;
    bool covered(Vector x) const;
    /// True where the surface goes on beyond an edge towards a point that sees it along `way`: that is nearer, the edge no face.
    bool continued(Vector edge, Vector way) const;

    const Scene& scene_;
    int dimensions_;
    double tolerance_; // m
    std::vector<Part> parts_;
};

/// The exposed faces of many points, no further than `reach` from each.
class PointFaces {
public:
    PointFaces() = default;
    PointFaces(const WallSurface&, std::span<const double> x, std::span<const double> y, std::span<const double> z, double reach);
    std::size_t size() const { return n_; }
    std::span<const Face> operator[](std::size_t point) const
    {
        const Part& p = parts_[point / share_];
        const std::size_t k = point % share_;
        return {p.faces.data() + p.first[k], p.faces.data() + p.first[k + 1]};
    }
    /// Of all points.
    std::size_t faces() const;
    std::size_t bytes() const;

private:
    struct Part { // made by one thread
        std::vector<Index> first;
        std::vector<Face> faces;
    };
    std::size_t n_ = 0, share_ = 1; // points, in all and in a part
    std::vector<Part> parts_;
};

} // namespace kuzure
