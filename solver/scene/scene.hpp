#pragma once
// A scene as plain structs, in SI units and radians.
#include "solver/scene/parts.hpp"

namespace kuzure::scene {

// ---- accuracy, output ----
/// Which named set of accuracy keys a scene started from; the keys themselves decide.
enum class Preset { Seed, Fast, Standard, Accurate };
struct Accuracy {
    Preset preset = Preset::Standard;
    Kernel kernel = Kernel::WendlandC2;
    KernelNorm kernel_norm = KernelNorm::Lattice;
    double cfl = 1.0;
    Scheme scheme = Scheme::Staggered;
    Precision precision = Precision::Double;
    Correction correction = Correction::None;
    double shifting = 0;    // constant C of the shifting of particles in plastic flow; 0: none
    double hourglass = 0;   // strength xi of the hourglass control in soil that does not yield; 0: none
    double skin = 0.2;      // list skin in support radii (2 h): cost only, results change in their last bits
    double sleep_below = 0; // m/s; soil that is slower, among soil that is slower, sleeps; 0: never
    bool operator==(const Accuracy&) const = default;
};

enum class View { Oblique, Side, Top, Slice }; // Slice: along x through the soil's middle, seen from the side
enum class Color { Displacement, Speed, PlasticStrain, Pressure };
struct Picture {
    View view = View::Oblique;
    Color color = Color::Displacement;
    std::array<double, 2> range{}; // of the colours, in the colour's unit; 0, 0: what the soil shows, anew in every picture
    bool operator==(const Picture&) const = default;
};
struct Output {
    std::string directory;       // empty: results/<scene file's name>
    std::optional<double> every; // s between snapshots
    std::vector<std::string> fields{"velocity", "stress", "density", "plastic_strain", "displacement"};
    std::optional<double> history; // s between rows of history.csv
    std::optional<double> grain;   // m, column height at which a front counts; absent: one spacing
    double checkpoint_minutes = 30;
    std::optional<Picture> picture;
    bool movie = false; // the pictures as one film at the end of the run
    bool operator==(const Output&) const = default;
};

struct Space {
    double spacing;                  // m
    double h = 1.3;                  // smoothing length in spacings
    std::optional<Vector> low, high; // m, box that particles may not leave
    std::array<bool, 3> periodic{};
    bool operator==(const Space&) const = default;
};
struct Time {
    double end;                 // s
    std::optional<double> step; // s, fixed step
    bool retry = false;         // on failing numbers: back to the last good state, on with half the step
    bool operator==(const Time&) const = default;
};

/// The state a run starts from, instead of bodies as they are drawn.
struct Start {
    std::string from; // result directory or checkpoint of another run, an absolute path; empty: none
    bool operator==(const Start&) const = default;
};

// ---- real ground ----
enum class Edge { Open, Closed }; // what soil does that leaves the ground: it is counted, or it ends the run
/// Elevation models, and how soil meets the ground. The ground itself is a wall with the shape Ground, made from these at reading.
struct Terrain {
    std::vector<std::string> dem;                // absolute paths; a later one fills what earlier ones leave open
    std::string crs;                             // "EPSG:6670"; empty: that of the files
    std::optional<std::array<double, 4>> window; // m, x and y from, x and y to, in the CRS; absent: what releases reach
    Surface surface = Surface::Coulomb;
    double friction_angle = 0; // rad, for Coulomb
    std::string friction_map;  // raster of such angles, an absolute path
    std::optional<double> xi;  // m/s^2, Voellmy's: a traction of rho g v^2/xi beside friction
    Edge edge = Edge::Open;
    GroundLattice lattice = GroundLattice::Draped;
    bool operator==(const Terrain&) const = default;
};
// ---- stages ----
/// What an event makes of a soil; what is absent stays as it was.
struct SoilChange {
    int soil = 0;                                         // index into Scene::soils; -1: there is none of that name
    std::optional<double> young, poisson, cohesion;       // Pa, 1, Pa
    std::optional<double> friction_angle, dilation_angle; // rad
    std::optional<double> tension_cutoff;                 // Pa
    std::optional<Cone> cone;
    std::optional<double> strength, stiffness; // factors of c, tan(phi) and the cut-off; of Young's modulus
    bool operator==(const SoilChange&) const = default;
};
/// A vector over time, read from a file: rows of s and x, y, z; straight between two rows.
struct Record {
    std::string file; // an absolute path; empty: none
    std::shared_ptr<const std::vector<std::array<double, 4>>> rows;
    bool operator==(const Record&) const; // by its rows
};
/// A turn about a line through `center`, which moves along, m; `axis` need not be of unit length; rad/s.
struct Turn {
    Vector center{}, axis{0, 1, 0};
    double rate = 0;
    bool operator==(const Turn&) const = default;
};
/// How an event moves a wall as long as it lasts, m/s.
struct WallMove {
    std::string wall; // its name
    Vector velocity{};
    std::optional<Turn> turn;
    double ramp = 0; // s, in which the motion comes to its speed, and in which it ends
    Record path;     // m, from where the wall stands when the event begins; instead of all of these
    bool operator==(const WallMove&) const = default;
};
/// Pushes the free faces of soil: with a pressure, or with a traction on the area that is seen along a normal.
struct Load {
    std::string name = {}, body = {};    // empty: none, any
    std::optional<Box> box = {};         // m, where the soil lies that it pushes; absent: anywhere
    std::optional<double> pressure = {}; // Pa
    std::optional<Vector> traction = {}; // Pa
    std::optional<Vector> normal = {};   // of the face, outward, of any length; absent: every face
    bool follow = false;                 // the pressure acts on the face as it is now, else as it was when the load began
    bool plate = false;                  // what it pushes moves along the normal as one: a weightless plate lies on it
    double factor = 1;                   // how much of it acts
    bool present = true;                 // as of a body
    bool operator==(const Load&) const = default;
};
/// What an event makes of a load.
struct LoadChange {
    std::string name;
    double factor = 1;
    bool operator==(const LoadChange&) const = default;
};
/// A change of the scene while it runs: at one time, or linearly from one to another. What is absent stays as it was.
struct Event {
    std::optional<double> at, from, to;       // s; at alone, or from and to
    std::vector<std::string> add, remove;     // names of walls, bodies and loads
    std::optional<Vector> gravity;            // m/s^2
    Record shaking;                           // m/s^2, acceleration of the ground; no rows: none
    std::vector<std::array<double, 2>> water; // x, z in m, the new water table; empty: as it was
    std::optional<double> damping;            // of critical, 1; 0: none
    std::vector<SoilChange> soils;
    std::optional<WallMove> move;
    std::optional<LoadChange> load;
    bool operator==(const Event&) const = default;
};
/// A row a time in probes.csv: of a point, of one particle or of the mean of a body.
struct Probe {
    std::string name;            // empty: its number
    std::optional<Vector> point; // m
    std::optional<int> particle; // id
    std::string body;
    bool operator==(const Probe&) const = default;
};

/// Where the scene's coordinates lie on the map.
struct MapFrame {
    std::string crs;     // as WKT; empty: nowhere
    double x = 0, y = 0; // m, map coordinates of the scene's origin
    bool operator==(const MapFrame&) const = default;
};
/// Rasters of what happened.
struct Maps {
    double cell = 0;            // m; 0: two spacings
    double wet = 0;             // m, least thickness that counts; 0: one spacing
    std::vector<double> limits; // m, thicknesses whose outlines are drawn
    std::string points;         // file of named points, an absolute path; empty: none
    bool operator==(const Maps&) const = default;
};

} // namespace kuzure::scene

namespace kuzure {

struct Scene {
    std::string title;
    int dimensions = 3;
    scene::Space space;
    scene::Time time;
    std::vector<scene::Soil> soils;
    std::vector<scene::Body> bodies;
    std::vector<scene::Wall> walls;
    std::optional<scene::Terrain> terrain;
    scene::MapFrame map_frame; // of the terrain
    std::optional<scene::Maps> maps;
    std::vector<scene::Load> loads;
    std::vector<scene::Event> events;
    std::vector<scene::Probe> probes;
    scene::Start start;
    scene::Effects effects;
    scene::Accuracy accuracy;
    scene::Output output;
    std::vector<scene::EffectNote> notes; // made by resolve()

    double smoothing_length() const { return space.h * space.spacing; } // m
    double support() const { return 2 * smoothing_length(); }           // m
    /// Volume (3-D, m^3) or area (2-D, m^2 per metre of thickness) of one particle.
    double particle_volume() const
    {
        return dimensions == 3 ? space.spacing * space.spacing * space.spacing : space.spacing * space.spacing;
    }
    scene::Interactions interactions() const
    {
        return {dimensions,        space.spacing,        smoothing_length(),  effects,
                accuracy.kernel,   accuracy.precision,   accuracy.correction, accuracy.scheme,
                accuracy.shifting, accuracy.kernel_norm, accuracy.hourglass};
    }
    bool operator==(const Scene&) const = default;
};

} // namespace kuzure
