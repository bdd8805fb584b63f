#pragma once
/// @file
/// Runs of kuzure out of other programs: `#include <kuzure/simulation.hpp>`, link `kuzure::kuzure`. Nothing else of kuzure is needed, and
/// no flag of the compiler. SI units, angles in degrees, stress positive in tension: the words and units of scene files.
#include <cstdint>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

/// What kuzure gives to other programs. All failures are exceptions whose what() is the message that `kuzure` prints: std::runtime_error
/// where the scene is wrong, where the numbers fail or where a file does, std::logic_error where the call or kuzure itself is wrong.
namespace kuzure::api {

/// The ranks of this program, as long as this lives: those of MPI where a launcher (mpirun, srun) started it, else one. One per program,
/// made before everything else and the last to go. Not for programs that start MPI themselves.
class Ranks {
public:
    /// With the arguments of main(), from which some MPI libraries take theirs.
    Ranks(int& argc, char**& argv);
    /// Ends MPI, where it was started.
    ~Ranks();
    Ranks(const Ranks&) = delete;
    Ranks& operator=(const Ranks&) = delete;

    /// The number of this rank, from 0.
    int rank() const;
    /// How many there are.
    int size() const;

private:
    struct Inside;
    std::unique_ptr<Inside> inside_;
};

/// What is to be simulated, checked by every rule of `kuzure check`; the keys are those of docs/scene.md.
class Scene {
public:
    /// Of a scene file; each of `sets` is "key.path=value", as after --set, and overrides the file.
    static Scene read(const std::string& file, const std::vector<std::string>& sets = {});
    /// Of the text of one; messages call it `name`, and paths in it count from the folder of that name.
    static Scene parse(std::string_view text, const std::vector<std::string>& sets = {}, const std::string& name = "scene");
    /// The same scene with one number changed: with("soil.sand.friction_angle", 30) is 30 degrees.
    Scene with(const std::string& key, double value) const;

    /// As a scene file with every default written out.
    std::string text() const;
    /// What is allowed but hardly meant, in words.
    std::vector<std::string> warnings() const;
    /// Distance of the particles, m.
    double spacing() const;
    /// Volume of a particle, m^3; in plane strain its area, m^2.
    double particle_volume() const;
    /// When the run ends, s.
    double end() const;
    /// The names of its soils, in the order of Particle::soil.
    std::vector<std::string> soils() const;

private:
    friend class Simulation;
    struct Inside;
    explicit Scene(std::shared_ptr<const Inside>);
    std::shared_ptr<const Inside> inside_;
};

/// A vector: x and y level, z up.
struct Vector {
    double x = 0; ///< along x
    double y = 0; ///< along y
    double z = 0; ///< upwards
};

/// A symmetric tensor of stress, Pa, positive in tension.
struct Stress {
    double xx = 0; ///< normal, along x
    double yy = 0; ///< normal, along y
    double zz = 0; ///< normal, upwards
    double xy = 0; ///< shear in the level plane
    double yz = 0; ///< shear in the plane of y and z
    double xz = 0; ///< shear in the plane of x and z
    /// Mean pressure, Pa, positive in compression.
    double pressure() const { return -(xx + yy + zz) / 3; }
};

/// A particle of soil at the present time.
struct Particle {
    std::int64_t id = 0;       ///< its own for the whole run, on any rank
    int soil = 0;              ///< number of its soil, as in Scene::soils()
    Vector position;           ///< m
    Vector displacement;       ///< m, since t = 0
    Vector velocity;           ///< m/s
    double density = 0;        ///< kg/m^3, with what has opened
    Stress stress;             ///< Pa
    double plastic_strain = 0; ///< accumulated plastic shear strain, 1
};

/// Energies of all soil, J (in plane strain J a metre), as the columns of history.csv: the first three are of the state, the others were
/// taken since t = 0.
struct Energies {
    double kinetic = 0;     ///< of motion
    double potential = 0;   ///< of weight, from where the soil was at t = 0
    double elastic = 0;     ///< stored by elastic strain
    double plastic = 0;     ///< by plastic flow
    double viscous = 0;     ///< by artificial viscosity
    double wall = 0;        ///< by friction on walls
    double damping = 0;     ///< by the damping that a scene asks for
    double stabilising = 0; ///< by artificial stress and stress diffusion, which may give as well
    double moved_wall = 0;  ///< by walls that move; negative where they push
    double events = 0;      ///< by events
    double loads = 0;       ///< by loads; negative where they push
    /// Of all of them: constant, but for the error of the steps.
    double sum() const;
};

/// A run in memory. It writes nothing; what it gives has the bits of `kuzure run` on any number of ranks and threads (OMP_NUM_THREADS).
/// Every rank makes it and steps it alike; what is called collective must be called on all of them.
class Simulation {
public:
    /// Fills the scene, and settles the soil where the scene asks for rest. Collective. A scene that starts from another run ([start])
    /// is refused.
    Simulation(const Ranks&, const Scene&);
    ~Simulation();
    Simulation(const Simulation&) = delete;
    Simulation& operator=(const Simulation&) = delete;

    /// One step; where the numbers fail, and the scene says time.retry, again from the last good state with half the length. Collective.
    void step();
    /// Steps to the first time that is not before this one, s, or to the end of the scene. Collective.
    void run(double until = std::numeric_limits<double>::infinity());
    /// Whether the end of the scene is reached.
    bool finished() const;

    /// The present time, s.
    double time() const;
    /// Steps since t = 0.
    std::int64_t steps() const;
    /// The greatest speed of a particle in the last step, over all ranks, m/s.
    double max_speed() const;
    /// The particles on this rank, in an order that changes as they move.
    std::vector<Particle> particles() const;
    /// How many there are on all ranks. Collective.
    std::int64_t count() const;
    /// Energies of now. Collective.
    Energies energies() const;
    /// The hash of the whole state that summary.json has: equal exactly where all bits are. Collective.
    std::string state_hash() const;

private:
    struct Inside;
    std::unique_ptr<Inside> inside_;
};

} // namespace kuzure::api
