// kuzure run: the run loop, and everything a run leaves in its directory.
#include "io/checkpoint.hpp"
#include "io/history.hpp"
#include "io/keys.hpp"
#include "io/picture_series.hpp"
#include "io/result_directory.hpp"
#include "io/snapshot.hpp"
#include "io/soil_color.hpp"
#include "io/summary.hpp"
#include "perf/report.hpp"
#include "solver/app/cli/command.hpp"
#include "solver/app/cli/command_line.hpp"
#include "solver/app/cli/signals.hpp"
#include "solver/app/report/movie.hpp"
#include "solver/app/report/report.hpp"
#include "solver/app/run/clock_text.hpp"
#include "solver/app/run/fronts.hpp"
#include "solver/app/run/sound_state.hpp"
#include "solver/app/run/status.hpp"
#include "solver/app/scaling/estimate.hpp"
#include "solver/app/scaling/forecast.hpp"
#include "solver/app/study/twins.hpp"
#include "solver/core/simd.hpp"
#include "solver/run/simulation.hpp"
#include "solver/scene/check.hpp"
#include <CLI/CLI.hpp>
#include <chrono>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>
#include <unistd.h>

namespace kuzure {

namespace {

struct Arguments {
    SceneArguments scene;
    std::string output;
    std::optional<std::string> restart; // empty: the newest good checkpoint
    int threads = 0;
    double max_minutes = 0;
    bool force = false, force_size = false, quiet = false, plain = false;
    int recut_every = 0;
    bool twins = false, check_only = false;
    Progress progress = Progress::Auto;
    // Of a twin: when the program it belongs to began (s), and the STOP file of the run it belongs to.
    std::optional<double> began;
    io::Path also_stop;
};

double now() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

/// A simulation's clock as a checkpoint keeps it, with the greatest speed (m/s) of all legs.
std::string header_text(const Simulation& sim, double peak_speed)
{
    auto j = nlohmann::ordered_json::parse(clock_text(sim));
    j["peak_speed"] = peak_speed;
    return j.dump();
}

/// The greatest speed (m/s) of the run up to a checkpoint; 0 where an older program left it out.
double peak_speed_of(const io::Checkpoint& from)
{
    const auto j = nlohmann::json::parse(from.header, nullptr, false);
    return j.is_object() && j.contains("peak_speed") && j["peak_speed"].is_number() ? j["peak_speed"].get<double>() : 0;
}

/// This rank's even share of all wall particles, for snapshots and pictures.
io::WallPoints wall_share(const Comm& comm, const scene::Filling& f, const std::vector<Material>& soils)
{
    io::WallPoints w;
    const std::int64_t n = f.wall_count(), first = f.soil_count();
    const std::int64_t begin = n * comm.rank() / comm.size(), end = n * (comm.rank() + 1) / comm.size();
    for (std::int64_t k = begin; k < end; ++k) {
        w.position.push_back(f.wall_position(first + k));
        w.id.push_back(first + k);
        w.density.push_back(soils.front().density);
    }
    return w;
}

class Run {
public:
    Run(const Comm& comm, const Arguments& a) : Run(comm, a, a.scene.read(comm)) {}

    Exit go()
    {
        try {
            open();
            if (args_.twins && !run_twins()) return stop_before_the_run();
            return loop();
        } catch (const io::CheckpointFailed&) {
            throw; // says itself which one is good
        } catch (const IoFailed& e) {
            if (!sim_) throw;
            throw IoFailed(e.what() + last_good_checkpoint());
        }
    }

private:
    Run(const Comm& comm, const Arguments& a, scene::Ready ready, bool twin = false)
        : comm_(comm), args_(a), twin_(twin), start_(now()), threads_(use_threads(comm, a.threads)), scene_(std::move(ready.scene)),
          doubts_(std::move(ready.warnings)), filling_(std::move(ready.filling)), hash_(io::scene_hash(scene_)),
          speaks_(comm.rank() == 0 && !a.quiet)
    {
    }

    /// The coarser twins, before the run itself: what they leave becomes error bars at its end. A twin that fails costs its bar only; one
    /// that was stopped goes on where the run is restarted. False if one was stopped.
    bool run_twins()
    {
        for (const int factor : study::twin_factors) {
            study::TwinRun t;
            t.twin.factor = factor;
            t.directory = dir_->path() / "twins" / fmt::format("x{}", factor);
            try {
                t.twin = study::coarsened(scene_, factor);
                std::string status; // of an earlier leg
                if (args_.restart && comm_.rank() == 0) {
                    std::error_code ignored;
                    if (std::filesystem::exists(t.directory / "summary.json", ignored)) {
                        const auto j = nlohmann::json::parse(io::read_text(t.directory / "summary.json"), nullptr, false);
                        if (j.is_object() && j.contains("status") && j["status"].is_string() && j.contains("scene_hash") &&
                            j["scene_hash"] == io::scene_hash(t.twin.scene))
                            status = j["status"];
                    }
                    if (status.empty() && std::filesystem::exists(t.directory / "checkpoint.h5", ignored)) status = "killed";
                }
                status = comm_.broadcast(status);
                if (status != "finished") {
                    Arguments a = args_;
                    a.output = t.directory.string(), a.twins = false, a.quiet = true, a.force = true;
                    a.began = start_, a.also_stop = dir_->stop().path();
                    if (status.empty()) a.restart.reset();
                    else a.restart = ""; // its own newest checkpoint
                    say(fmt::format("twin of {} times the spacing, in {}", factor, t.directory.string()));
                    scene::Issues issues; // coarsened() threw where one is an error
                    if (Run(comm_, a, scene::ready(t.twin.scene, scene::StepLimit::Force, issues).value(), true).go() == Exit::Stopped)
                        return false;
                }
            } catch (const BadInput& e) {
                t.failed = e.what();
            } catch (const NumbersFailed& e) {
                t.failed = e.what();
            }
            if (!t.failed.empty()) say(fmt::format("the twin of {} times the spacing failed: {}", factor, t.failed));
            twins_.push_back(std::move(t));
        }
        return true;
    }

    /// A twin was stopped: the run's own checkpoint, of where it stands, lets a restart find the directory and go on with the twin.
    Exit stop_before_the_run()
    {
        first_step_ = sim_->steps();
        write_checkpoint();
        write_summary("stopped", Exit::Stopped);
        return say_stopped();
    }

    Exit say_stopped()
    {
        const auto text = fmt::format("stopped on request at t = {:g} s, step {}; checkpoint {} (go on with --restart)", sim_->time(),
                                      sim_->steps(), checkpoint_.string());
        if (args_.quiet && comm_.rank() == 0 && !twin_) std::fprintf(stderr, "kuzure: %s\n", text.c_str());
        say(text);
        return Exit::Stopped;
    }

    void say(const std::string& text)
    {
        if (status_) status_->make_room();
        // Not by fmt, which throws: a run goes on when nobody can read what it says.
        if (speaks_) std::fputs((text + "\n").c_str(), stdout), std::fflush(stdout);
    }

    void warn(const std::string& text)
    {
        warnings_.push_back(text);
        if (comm_.rank() == 0 && !twin_) complain("warning: " + text);
    }

    void open()
    {
        for (const auto& issue : doubts_) warn(in_words(issue));
        if (const auto why = too_many_threads(comm_, threads_); !why.empty()) warn(why);
        const io::Path where = args_.scene.results(scene_, args_.output);
        std::optional<io::Checkpoint> from;
        // From here on no other run touches what is there.
        const auto existing = args_.restart ? io::Existing::GoOn : args_.force ? io::Existing::MoveAside : io::Existing::Refuse;
        dir_.emplace(comm_, where, existing, complain);
        if (args_.restart) {
            if (!args_.restart->empty()) from = io::verify_checkpoint(comm_, *args_.restart);
            else from = io::newest_good(comm_, dir_->place(), complain);
            if (!from) say(fmt::format("no checkpoint in {}: starting from the beginning", where.string()));
        }
        bool here = true; // of another directory nothing is touched
        if (from) {
            std::error_code error;
            here = comm_.any(comm_.rank() == 0 && std::filesystem::equivalent(where, io::directory_of(from->file).path(), error));
            require_same_scene(comm_, *from, scene_);
            if (!here) require_room_for(*from, where);
        }
        RunOptions options{args_.plain ? Arithmetic::Scalar : Arithmetic::Simd, args_.recut_every};
        const double done = from ? std::clamp(clock_from_text(from->header, from->file).time / scene_.time.end, 0.0, 1.0) : 0;
        const Estimate e = estimate(scene_, *filling_, *choose_model(scene_, options.arithmetic));
        fits_or_throw(e, where, done);
        forecast_ = forecast(comm_, scene_, *filling_, e, done);
        options.filling = std::exchange(filling_, std::nullopt);
        std::optional<double> restart_time;
        if (from) {
            Particles p;
            io::read_checkpoint(comm_, *from, p);
            const Clock clock = clock_from_text(from->header, from->file);
            restart_time = clock.time, peak_speed_ = peak_speed_of(*from);
            require_sound_state(comm_, *from, p, scene_, *options.filling);
            const auto fields = field_names(p);
            checkpoint_ = from->file;
            sim_ = std::make_unique<Simulation>(comm_, scene_, std::move(p), clock, std::move(options));
            require_fields(comm_, *from, fields, sim_->particles());
            dir_->make(io::Existing::GoOn);
            if (here) checkpoint_ = io::keep_generation(comm_, *from);
            say(fmt::format("going on from {} at t = {:g} s, step {}", from->file.string(), clock.time, clock.step));
            if (const auto writer = other_writer(*from); !writer.empty())
                warn(fmt::format("this checkpoint was written by {}; this is {}: the bits from here on may be others", writer,
                                 version_text()));
        } else {
            sim_ = std::make_unique<Simulation>(comm_, scene_, std::move(options)); // what it refuses leaves nothing behind
            dir_->make(args_.restart ? io::Existing::MoveAside : existing);
            if (!dir_->moved_to().empty()) say(fmt::format("the old results are now in {}", dir_->moved_to().string()));
        }
        io::on_root(comm_, [&] {
            char host[256] = "";
            gethostname(host, sizeof host - 1);
            io::write_atomically(dir_->scene(),
                                 fmt::format("# {}\n# host {}, {} ranks x {} threads, scene hash {}, pair model {}\n{}", version_text(),
                                             host, comm_.size(), threads_, hash_, sim_->model().name(), io::write_scene(scene_)));
            io::remove_file(dir_->stop());
        });
        walls_ = wall_share(comm_, sim_->filling(), {sim_->soils().begin(), sim_->soils().end()});
        snapshots_.emplace(comm_, dir_->snapshots(), restart_time);
        history_.emplace(comm_, dir_->history(), scene_.dimensions, restart_time);
        progress_.emplace(comm_, dir_->progress(), restart_time);
        say(fmt::format("{}\n{} soil and {} wall particles, {} ranks x {} threads, {}", scene_.title, sim_->filling().soil_count(),
                        sim_->filling().wall_count(), comm_.size(), threads_, sim_->model().name()));
        say(fmt::format("predicted: {}", forecast_text(forecast_)));
    }

    /// A checkpoint of elsewhere goes on where its own scene left results, or where nothing is yet: never among those of another. Throws
    /// BadInput.
    void require_room_for(const io::Checkpoint& from, const io::Path& where)
    {
        io::on_root(comm_, [&] {
            std::error_code error;
            if (!std::filesystem::exists(where, error) || std::filesystem::is_empty(where, error)) return;
            std::string found = "no scene.toml";
            if (std::filesystem::exists(where / "scene.toml", error)) {
                found = "the results of another scene";
                try {
                    if (io::scene_hash(io::read_scene(where / "scene.toml", {}, scene::StepLimit::Force)) == hash_) return;
                } catch (const std::runtime_error&) { // of another version: not this run's
                }
            }
            throw BadInput(fmt::format("{}: expected nothing, or results of this scene, to go on from {}; found {}. Choose another with -o",
                                       where.string(), from.file.string(), found));
        });
    }

    /// Before anything is allocated or written: a run that must end with full memory or a full disk does not begin.
    void fits_or_throw(const Estimate& e, const io::Path& where, double done)
    {
        const auto why = does_not_fit(comm_, e, where, done);
        if (why.empty()) return;
        if (!args_.force_size) throw BadInput(fmt::format("{}: this run does not fit: {}; or --force-size to try", args_.scene.file, why));
        warn(why + "; going on as told by --force-size");
    }

    /// True if something that comes every `interval` s is due at this step and was not there at the one before.
    static bool due(std::optional<double> interval, double time, double before)
    {
        if (!interval) return false;
        const auto count = [&](double t) { return std::floor(t / *interval * (1 + 1e-12) + 1e-9); };
        return before < 0 || count(time) > count(before);
    }

    void outputs(double before, bool last)
    {
        Simulation& sim = *sim_;
        const double t = sim.time();
        if (before < 0 || last || due(scene_.time.end / 400, t, before)) log_progress();
        if (due(scene_.output.history, t, before) || last || before < 0) {
            if (!history_->last_time() || t > *history_->last_time()) sim.timers().timed(Phase::History, [&] { write_history(); });
        }
        if (due(scene_.output.every, t, before) || last || before < 0) {
            if (!snapshots_->last_time() || t > *snapshots_->last_time()) {
                sim.timers().timed(Phase::Snapshot, [&] { write_snapshot({}); });
            }
        }
    }

    void log_progress()
    {
        const double wall = now() - start_;
        const double rate = wall > logged_wall_ ? double(sim_->steps() - logged_step_) / (wall - logged_wall_) : 0;
        if (!progress_->last_time() || sim_->time() > *progress_->last_time())
            progress_->append({sim_->time(), sim_->steps(), sim_->dt(), wall, sim_->steps() > logged_step_ ? rate : std::nan(""),
                               sim_->balance().imbalance()});
        logged_wall_ = wall, logged_step_ = sim_->steps();
    }

    void write_history()
    {
        const Ledger l = sim_->ledger();
        heap_ = measure_heap(comm_, sim_->particles(), scene_, sim_->filling());
        const Heap& heap = *heap_;
        residual_ = sim_->residual(l);
        // energy.cpp's sums, and the columns they and the heap read
        const auto n = double(sim_->particles().size());
        sim_->timers().did(Phase::History, 45 * n, 20 * 8 * n);
        history_->append({sim_->time(), sim_->steps(), sim_->dt(), l.state.kinetic, l.state.potential, l.state.elastic,
                          l.dissipated.plastic, l.dissipated.viscous, l.dissipated.wall, l.dissipated.damping, *residual_,
                          sim_->max_speed(), heap.height, heap.min_x, heap.max_x, heap.min_y, heap.max_y, l.dissipated.stabilising, 0.0});
    }

    void write_snapshot(std::optional<std::int64_t> failed)
    {
        io::SnapshotLabel label{sim_->time(), sim_->steps(), scene_.dimensions, scene_.title, scene_.output.fields, failed};
        // What colours the pictures is kept, asked for or not.
        if (scene_.output.picture && !label.fields.empty())
            if (const std::string behind = io::field_behind(scene_.output.picture->color); std::ranges::count(label.fields, behind) == 0)
                label.fields.push_back(behind);
        snapshots_->write(sim_->particles(), walls_, label);
    }

    /// The pictures, from the snapshots and when the last of them is there: one camera and one range for all. Without them the results
    /// are complete, so what the program cannot draw is said and nothing more.
    void draw_pictures()
    {
        if (!scene_.output.picture) return;
        sim_->timers().timed(Phase::Picture, [&] {
            try {
                io::remove_pictures(comm_, dir_->place()); // also those of snapshots that a restart took back
                auto task = picture_task(scene_, dir_->place());
                task.tolerant = true;
                for (const auto& w : io::draw_pictures(comm_, task).warnings) warn(w);
            } catch (const BadInput& e) {
                warn(e.what());
            }
        });
    }

    /// Snapshot of a state whose numbers failed; its picture has a ring around the particle to blame.
    void keep_moment_of_failure()
    {
        if (!snapshots_->last_time() || sim_->time() > *snapshots_->last_time()) write_snapshot(sim_->failed_id());
    }

    std::string last_good_checkpoint() const
    {
        return checkpoint_.empty() ? ". No checkpoint had been written" : ". The last good checkpoint is " + checkpoint_.string();
    }

    void write_checkpoint()
    {
        sim_->timers().timed(Phase::Checkpoint, [&] {
            history_->sync();
            dir_->require_owned();
            checkpoint_ = io::write_checkpoint(comm_, dir_->place(), sim_->particles(), hash_, header_text(*sim_, peak_speed_));
        });
        last_checkpoint_ = now();
    }

    void write_summary(const std::string& status, Exit code, const std::string& message = {})
    {
        const Ledger l = sim_->ledger();
        const double seconds = now() - start_;
        const WorkDone work = sim_->work_done();
        const std::int64_t steps_here = sim_->steps() - first_step_;
        const double stepping = loop_seconds_;
        io::Summary s;
        s.status = status, s.exit_code = int(code), s.scene_hash = hash_, s.version = version_text();
        s.ranks = comm_.size(), s.threads = threads_;
        s.precision = sim_->model().precision() == scene::Precision::Mixed ? "mixed" : "double";
        s.soil_particles = sim_->filling().soil_count(), s.wall_particles = sim_->filling().wall_count();
        s.steps = sim_->steps(), s.time = sim_->time(), s.wall_seconds = seconds, s.pairs = sim_->pairs();
        s.seconds_per_step = steps_here > 0 ? stepping / double(steps_here) : 0;
        const std::int64_t particle_steps = comm_.sum(work.particle_steps);
        s.particle_steps_per_second = stepping > 0 ? double(particle_steps) / stepping : 0;
        s.energy = {{"kinetic", l.state.kinetic},      {"potential", l.state.potential},          {"elastic", l.state.elastic},
                    {"plastic", l.dissipated.plastic}, {"viscous", l.dissipated.viscous},         {"wall", l.dissipated.wall},
                    {"damping", l.dissipated.damping}, {"stabilising", l.dissipated.stabilising}, {"moved_wall", 0.0},
                    {"residual", sim_->residual(l)}};
        s.effects = scene_.notes;
        s.state_hash = state_hash(comm_, sim_->particles());
        s.message = message;
        s.host = host_name(), s.hosts = comm_.node_place().nodes, s.warnings = warnings_;
        s.predicted_seconds = forecast_.seconds, s.predicted_low = forecast_.low, s.predicted_high = forecast_.high;
        const std::int64_t memory = comm_.max(std::int64_t(sim_->memory_bytes()));
        auto j = io::to_json(s);
        j["memory_bytes_per_rank"] = memory;
        if (sim_->filling().wall_count() > 0) j["walls_in"] = {"snapshots/state_000000.hdf", "snapshots/walls.hdf"};
        j["rebuilds"] = sim_->rebuilds();
        j["repartitions"] = sim_->balance().cuts();
        j["repartitions_by_metis"] = sim_->balance().full_partitions();
        j["pair_model"] = sim_->model().name();
        const auto& seen = sim_->seen();
        j["guard"] = {{"clumped", seen.clumped}, {"most_clumped", seen.most_clumped}, {"deepest_in_wall", seen.deepest}};
        j["retries"] = retries_;
        j["peak_speed"] = peak_speed_;
        if (heap_) j["soil_off_ground"] = heap_->off_ground;
        if (args_.twins && code == Exit::Ok) {
            io::on_root(comm_, [&] { j["error_bars"] = study::error_bars(scene_, dir_->path(), peak_speed_, twins_); });
            if (speaks_)
                for (const auto& line : study::error_bar_lines(j["error_bars"])) say(line);
        }
        io::write_json(comm_, dir_->summary(), j);

        auto report = phase_report(sim_->timers(), work, threads_, comm_);
        // The roofs of this machine: those kept, or measured now if nobody waits for it and it does not weigh.
        const int on_node = threads_ * comm_.node_place().size;
        if (comm_.rank() == 0) report.machine = kept_machine(instruction_set(), on_node);
        if (!report.machine && comm_.size() == 1 && loop_seconds_ > 20) report.machine = this_machine(instruction_set(), on_node);
        io::on_root(comm_, [&] {
            io::write_atomically(*dir_ / "timers.json", report.json());
            io::write_atomically(*dir_ / "timers.txt", report.text());
        });
    }

    /// What people look at. The results are complete without it: trouble here is said and nothing more.
    void write_report()
    {
        if (comm_.rank() != 0) return;
        if (!dir_->in_place()) return complain(fmt::format("warning: no report.html: {} was moved meanwhile", dir_->path().string()));
        try {
            if (scene_.output.movie) say(fmt::format("film: {}", report::write_movie(dir_->path()).string()));
        } catch (const std::exception& e) {
            complain(fmt::format("warning: {}", e.what()));
        }
        try {
            report::write_report(dir_->path());
        } catch (const std::exception& e) {
            complain(fmt::format("warning: no report.html: {}", e.what()));
        }
    }

    /// What a run took against what was said before, and where its report is.
    void say_end(const std::string& how)
    {
        const double took = now() - start_;
        say(how);
        if (forecast_.seconds > 0)
            say(fmt::format("took {:.1f} s, predicted {:.1f} s ({:+.0f} %)", took, forecast_.seconds,
                            100 * (forecast_.seconds / took - 1)));
        say(fmt::format("results in {}, to begin with report.html", dir_->path().string()));
    }

    Requests wishes()
    {
        Requests w;
        const double t = now();
        w.stop = asked_to_stop() || (args_.max_minutes > 0 && t - args_.began.value_or(start_) > 60 * args_.max_minutes);
        if (comm_.rank() == 0) {
            if (t - last_look_ > 1) {
                last_look_ = t;
                stop_file_ = io::exists(dir_->stop()) || !dir_->owned() || (!args_.also_stop.empty() && io::exists(args_.also_stop));
            }
            w.stop = w.stop || stop_file_;
            w.checkpoint = t - last_checkpoint_ > 60 * scene_.output.checkpoint_minutes;
        }
        return w;
    }

    /// One step; where it fails and the scene allows it, back and on with half the step.
    Requests advance()
    {
        const Requests mine = wishes();
        try {
            return sim_->step(mine);
        } catch (const NumbersFailed& e) {
            const double time = sim_->time();
            const std::int64_t step = sim_->steps();
            if (!sim_->roll_back()) throw;
            // What was written after the good state is taken back.
            snapshots_.emplace(comm_, dir_->snapshots(), sim_->time());
            history_.emplace(comm_, dir_->history(), scene_.dimensions, sim_->time());
            progress_.emplace(comm_, dir_->progress(), sim_->time());
            retries_.push_back({{"failed_time", time}, {"failed_step", step}, {"from_time", sim_->time()}, {"message", e.what()}});
            say(fmt::format("retry: {}. Back to t = {:g} s, on with half the step", e.what(), sim_->time()));
            return {};
        }
    }

    Exit loop()
    {
        Simulation& sim = *sim_;
        status_.emplace(speaks_, args_.progress, scene_.time.end, sim.time(), sim.steps());
        const auto look = [&](bool final) {
            if (!status_->due(final)) return;
            status_->show({sim.time(), sim.steps(), sim.dt(), sim.max_speed(), residual_, heap_, scene_.dimensions, comm_.size(),
                           sim.balance().imbalance()},
                          final);
        };
        first_step_ = logged_step_ = sim.steps();
        logged_wall_ = now() - start_;
        last_checkpoint_ = now();
        const double begin = now();
        try {
            outputs(sim.steps() == 0 ? -1 : sim.time(), sim.finished());
            while (!sim.finished()) {
                const double before = sim.time();
                const Requests w = advance();
                loop_seconds_ = now() - begin;
                peak_speed_ = std::max(peak_speed_, sim.max_speed());
                outputs(before, sim.finished());
                if (!sim.finished()) look(false);
                if (w.stop && !sim.finished()) {
                    write_checkpoint();
                    look(true);
                    draw_pictures();
                    write_summary("stopped", Exit::Stopped);
                    write_report();
                    return say_stopped();
                }
                if (w.checkpoint) write_checkpoint();
            }
            write_checkpoint();
        } catch (const NumbersFailed& e) {
            loop_seconds_ = now() - begin;
            look(true);
            std::string text = e.what();
            try {
                keep_moment_of_failure();
                text += fmt::format(". The moment is in the last snapshot of {}", dir_->snapshots().string());
                text += last_good_checkpoint();
                draw_pictures();
                write_summary("numbers failed", Exit::NumbersFailed, text);
                write_report();
            } catch (const IoFailed& io) {
                text += fmt::format(". It could not be saved: {}", io.what());
            }
            throw NumbersFailed(text);
        }
        look(true);
        draw_pictures();
        write_summary("finished", Exit::Ok);
        write_report();
        say_end(fmt::format("{} steps in {:.1f} s ({:.2f} ms a step); energy residual {}", sim.steps() - first_step_, loop_seconds_,
                            1e3 * loop_seconds_ / std::max<double>(1, double(sim.steps() - first_step_)),
                            residual_ ? fmt::format("{:+.2e}", *residual_) : "unknown"));
        return Exit::Ok;
    }

    const Comm& comm_;
    Arguments args_;
    bool twin_; // its warnings are those of the run it belongs to
    double start_;
    int threads_;
    Scene scene_;
    scene::Issues doubts_;
    std::optional<scene::Filling> filling_; // until the simulation has it
    std::string hash_;
    bool speaks_;
    std::optional<StatusLine> status_;
    std::optional<io::ResultDirectory> dir_;
    std::unique_ptr<Simulation> sim_;
    io::WallPoints walls_;
    std::optional<io::Snapshots> snapshots_;
    std::optional<io::History> history_;
    std::optional<io::ProgressLog> progress_;
    io::Place checkpoint_;
    double last_checkpoint_ = 0, last_look_ = 0, loop_seconds_ = 0, logged_wall_ = 0;
    std::optional<double> residual_; // of the last row of the history
    std::optional<Heap> heap_;
    Forecast forecast_;
    std::vector<std::string> warnings_;
    bool stop_file_ = false;
    std::int64_t first_step_ = 0, logged_step_ = 0;
    std::vector<nlohmann::ordered_json> retries_;
    double peak_speed_ = 0; // m/s, over all steps
    std::vector<study::TwinRun> twins_;
};

} // namespace

void add_run(CLI::App& app, Action& chosen)
{
    auto* command = app.add_subcommand("run", "simulate a scene");
    auto a = std::make_shared<Arguments>();
    a->scene.add_to(*command);
    command->add_option("-o,--output", a->output, "result directory (default: [output] directory, or results/<scene>)")
        ->type_name("DIR")
        ->check([](const std::string& name) { return name.empty() ? "expected a directory, found \"\"" : ""; }, "");
    auto restart = std::make_shared<std::string>();
    auto* restarts =
        command->add_flag("--restart{newest}", *restart, "go on from the newest good checkpoint of the directory, or from FILE");
    command->add_option("--threads", a->threads, "threads of each rank (default: the node's cores shared by its ranks)")
        ->check(CLI::Range(1, 4096));
    command->add_option("--max-minutes", a->max_minutes, "stop with a checkpoint and exit code 5 after so many minutes")
        ->check(
            [](const std::string& text) {
                double minutes = 0;
                return CLI::detail::lexical_cast(text, minutes) && minutes > 0 && std::isfinite(minutes)
                           ? ""
                           : fmt::format("expected minutes above 0, such as 90 or 0.5, found \"{}\"", text);
            },
            "");
    command->add_flag("-n,--dry-run", a->check_only, "say what kuzure check says, and run nothing");
    command->add_option("--progress", a->progress, "auto (a bar on a terminal of its own, lines elsewhere), bar, plain or none")
        ->type_name("HOW")
        ->transform(CLI::Validator(
            [](std::string& how) {
                const auto& names = progress_names();
                const auto found = std::find(names.begin(), names.end(), how);
                if (found == names.end())
                    return fmt::format("expected {}, found \"{}\"{}", fmt::join(names, ", "), how, io::did_you_mean(how, names));
                how = std::to_string(found - names.begin());
                return std::string();
            },
            ""));
    command->add_flag("-q,--quiet", a->quiet, "print nothing but errors, warnings, and where a stopped run left its checkpoint");
    command->add_flag("--force", a->force, "move an existing result directory aside");
    command->add_flag("--force-size", a->force_size, "start although memory or disk will not be enough by kuzure's estimate");
    command->add_flag("--twins", a->twins, "first the same at 2 and 4 times the spacing: error bars on run-out, height and peak speed");
    command->add_flag("--plain", a->plain, "scalar arithmetic instead of lanes: the slow reference")->group("");
    command->add_option("--recut-every", a->recut_every, "cut the domain anew at every so many list rebuilds")->group("");
    under_heading(*command, "Scene", {"--set", "--force-step", "--dry-run"});
    under_heading(*command, "Results", {"--output", "--force", "--quiet", "--progress"});
    under_heading(*command, "How accurate", {"--twins"});
    under_heading(*command, "Start and stop", {"--restart", "--max-minutes"});
    under_heading(*command, "Machine", {"--threads", "--force-size"});
    command->callback([=, &chosen] {
        if (restarts->count() > 0) a->restart = *restart == "newest" ? "" : *restart;
        chosen = [=](const Comm& comm) { return a->check_only ? tell_of_run(comm, a->scene) : Run(comm, *a).go(); };
    });
}

} // namespace kuzure
