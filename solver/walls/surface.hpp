#pragma once
// The walls of a scene as one surface: the boundary of the union of all their shapes and of their images across the periods. A
// face that another wall covers or continues is no surface. How the same ground is cut or joined does not show.
#include "solver/scene/scene.hpp"
#include <vector>

namespace kuzure {

/// The tangent plane of the surface nearest to a point inside a wall: the points x with (x - point).normal = depth.
struct Face {
    Vector normal; // out of the wall
    double depth;  // m
    int wall;      // whose contact counts
};

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
    };
    bool covered(Vector x) const;
    /// True where the surface goes on beyond an edge towards a point that sees it along `way`: that is nearer, the edge no face.
    bool continued(Vector edge, Vector way) const;

    const Scene& scene_;
    int dimensions_;
    double tolerance_; // m
    std::vector<Part> parts_;
};

} // namespace kuzure
