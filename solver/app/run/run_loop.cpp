#include "solver/app/run/run_loop.hpp"
#include "solver/app/run/checkpoints.hpp"
#include "solver/app/run/clock_text.hpp"
#include "solver/app/run/ending.hpp"
#include "solver/app/run/outputs.hpp"
#include "solver/app/run/sound_state.hpp"
#include "solver/app/run/start_state.hpp"
#include "solver/app/run/stop.hpp"
#include "solver/app/run/twin_runs.hpp"
#include "solver/app/scaling/estimate.hpp"
#include "solver/core/ensure.hpp"
#include "solver/run/loads.hpp"
#include "solver/scene/check.hpp"
#include <algorithm>
#include <fmt/format.h>
#include <unistd.h>

namespace kuzure {

namespace {

class Run {
public:
    Run(const Comm& comm, const RunArguments& a, scene::CheckedScene checked, bool twin = false)
        : comm_(comm), args_(a), threads_(use_threads(comm, a.threads)), scene_(std::move(checked.scene)),
          scene_warnings_(std::move(checked.warnings)), filling_(std::move(checked.filling)), messages_(comm.rank() == 0, a.quiet, twin)
    {
        facts_.start = wall_clock(), facts_.scene_hash = io::scene_hash(scene_), facts_.threads = threads_, facts_.with_twins = a.twins;
    }

    Exit go()
    {
        try {
            try {
                open();
            } catch (const SettlingStopped& e) {
                messages_.say_aloud(fmt::format("{}; nothing was written. Run it again", e.what()));
                return Exit::Stopped;
            }
            if (args_.twins) {
                auto twins = run_twins(
                    comm_, args_, scene_, *directory_, messages_, facts_.start,
                    [&](const RunArguments& a, scene::CheckedScene checked) { return Run(comm_, a, std::move(checked), true).go(); });
                if (!twins) return stop_before_the_run();
                facts_.twins = std::move(*twins);
            }
            return loop();
        } catch (const io::CheckpointFailed&) {
            throw; // says itself which one is good
        } catch (const IoFailed& e) {
            if (!sim_) throw;
            throw IoFailed(e.what() + checkpoints_->last_in_words());
        }
    }

private:
    // ---- before the first step

    void open()
    {
        for (const auto& issue : scene_warnings_) messages_.warn(in_words(issue));
        if (const auto why = too_many_threads(comm_, threads_); !why.empty()) messages_.warn(why);
        const io::Path where = args_.scene.results(scene_, args_.output);
        // From here on no other run touches what is there.
        const auto existing = args_.restart ? io::Existing::GoOn : args_.force ? io::Existing::MoveAside : io::Existing::Refuse;
        directory_.emplace(comm_, where, existing, complain);
        checkpoints_.emplace(comm_, *directory_, facts_.scene_hash);
        const auto from = checkpoint_to_go_on_from(where);
        bool here = true; // of another directory nothing is touched
        if (from) {
            std::error_code error;
            here = comm_.any(comm_.rank() == 0 && std::filesystem::equivalent(where, io::directory_of(from->file).path(), error));
            require_same_scene(comm_, *from, scene_);
            if (!here) require_room_for(comm_, *from, where, facts_.scene_hash);
        }
        std::vector<io::NamedPoint> points;
        std::optional<KeptMaps> kept;
        if (scene_.maps) {
            points = points_of_maps(comm_, scene_, *filling_, [&](const std::string& w) { messages_.warn(w); });
            if (from) kept = maps_of(comm_, *from, scene_, *filling_);
        }
        RunOptions options{args_.plain ? Arithmetic::Scalar : Arithmetic::Simd, args_.recut_every};
        const double done = from ? std::clamp(clock_from_text(from->header, from->file).time / scene_.time.end, 0.0, 1.0) : 0;
        const Estimate e = estimate(scene_, *filling_, *choose_model(scene_, options.arithmetic));
        fits_or_throw(e, where, done);
        facts_.forecast = forecast(comm_, scene_, *filling_, e, done);
        options.filling = std::exchange(filling_, std::nullopt);
        std::optional<double> restart_time;
        if (from) {
            restart_time = go_on(*from, here, std::move(options));
        } else {
            start(std::move(options)); // what it refuses leaves nothing behind
            directory_->make(args_.restart ? io::Existing::MoveAside : existing);
            if (!directory_->moved_to().empty())
                messages_.say(fmt::format("the old results are now in {}", directory_->moved_to().string()));
        }
        write_scene();
        outputs_.emplace(comm_, scene_, *directory_, *sim_, restart_time, facts_.start);
        if (scene_.maps) outputs_->begin_maps(*sim_, std::move(points), kept, restart_time);
        messages_.say(fmt::format("{}\n{} soil and {} wall particles, {} ranks x {} threads, {}", scene_.title,
                                  sim_->filling().soil_count(), sim_->filling().wall_count(), comm_.size(), threads_,
                                  sim_->model().name()));
        messages_.say(fmt::format("predicted: {}", forecast_text(facts_.forecast)));
    }

    std::optional<io::Checkpoint> checkpoint_to_go_on_from(const io::Path& where)
    {
        if (!args_.restart) return std::nullopt;
        if (!args_.restart->empty()) return io::verify_checkpoint(comm_, *args_.restart);
        auto from = io::newest_good(comm_, directory_->place(), complain);
        if (!from) messages_.say(fmt::format("no checkpoint in {}: starting from the beginning", where.string()));
        return from;
    }

    /// Before anything is allocated or written: a run that must end with full memory or a full disk does not begin.
    void fits_or_throw(const Estimate& e, const io::Path& where, double done)
    {
        const auto why = does_not_fit(comm_, e, where, done);
        if (why.empty()) return;
        if (!args_.force_size) throw BadInput(fmt::format("{}: this run does not fit: {}; or --force-size to try", args_.scene.file, why));
        messages_.warn(why + "; going on as told by --force-size");
    }

    /// The simulation as a checkpoint left it; gives its time, s.
    double go_on(const io::Checkpoint& from, bool here, RunOptions options)
    {
        Particles p;
        io::read_checkpoint(comm_, from, p);
        const Clock clock = clock_from_text(from.header, from.file);
        facts_.peak_speed = peak_speed_of(from);
        require_sound_state(comm_, from, p, scene_, *options.filling, clock);
        const auto fields = field_names(p);
        checkpoints_->went_on_from(from.file);
        sim_ = std::make_unique<Simulation>(comm_, scene_, std::move(p), clock, std::move(options));
        require_fields(comm_, from, fields, sim_->particles());
        directory_->make(io::Existing::GoOn);
        if (here) checkpoints_->went_on_from(io::keep_generation(comm_, from));
        messages_.say(fmt::format("going on from {} at t = {:g} s, step {}", from.file.string(), clock.time, clock.step));
        if (const auto writer = other_writer(from); !writer.empty())
            messages_.warn(
                fmt::format("this checkpoint was written by {}; this is {}: the bits from here on may be others", writer, version_text()));
        return clock.time;
    }

    /// The simulation at t = 0: from the state of another run where the scene names one, else settled where the soil has to. Throws
    /// SettlingStopped where it is asked to stop meanwhile.
    void start(RunOptions options)
    {
        if (!scene_.start.from.empty()) {
            StartState state = start_state(comm_, scene_, *options.filling);
            messages_.say(fmt::format("starting from {}, t = {:g} s there", state.from, state.time));
            facts_.started_from = {{"checkpoint", state.from}, {"time", state.time}};
            options.start = std::move(state.particles);
        }
        StopRequests stop(comm_, args_, scene_, *directory_, facts_.start);
        double said = wall_clock();
        options.settling = [&](const Settling& s) {
            if (const double now = wall_clock(); now - said > 2) {
                said = now;
                messages_.say(fmt::format("settling: step {}, largest speed {:.2g} m/s", s.steps, s.speed));
            }
            return stop.now().stop;
        };
        sim_ = std::make_unique<Simulation>(comm_, scene_, std::move(options));
        if (const auto& s = sim_->settled()) {
            messages_.say(words_of(*s));
            if (!s->at_rest) messages_.warn(words_of(*s));
        }
        for (const auto& l : loaded_soil(comm_, sim_->scene(), sim_->particles()))
            if (l.particles > 0)
                messages_.say(fmt::format("load {} pushes {} particles, all of it by [{:.6g} {:.6g} {:.6g}] N{}", l.name, l.particles,
                                          l.force.x, l.force.y, l.force.z, scene_.dimensions == 2 ? " a metre" : ""));
    }
    static std::string words_of(const Settling& s)
    {
        return fmt::format("settled before t = 0: {} steps, moved by up to {:.2g} m, largest speed {:.2g} m/s{}{}", s.steps, s.displacement,
                           s.speed, s.held ? "; this soil does not stand by itself: it was held until it starts" : "",
                           s.at_rest ? "" : "; it was not at rest yet");
    }

    void write_scene()
    {
        io::on_root(comm_, [&] {
            char host[256] = "";
            gethostname(host, sizeof host - 1);
            io::write_atomically(directory_->scene(),
                                 fmt::format("# {}\n# host {}, {} ranks x {} threads, scene hash {}, pair model {}\n{}", version_text(),
                                             host, comm_.size(), threads_, facts_.scene_hash, sim_->model().name(),
                                             io::write_scene(scene_)));
            io::remove_file(directory_->stop());
        });
    }

    /// A twin was stopped: the run's own checkpoint, of where it stands, lets a restart find the directory and go on with the twin.
    Exit stop_before_the_run()
    {
        facts_.first_step = sim_->steps();
        write_checkpoint();
        ending().write_summary(*sim_, *outputs_, "stopped", Exit::Stopped);
        return say_stopped();
    }

    // ---- the steps

    Exit loop()
    {
        Simulation& sim = *sim_;
        messages_.begin_status(args_.progress, scene_.time.end, sim.time(), sim.steps());
        facts_.first_step = sim.steps();
        outputs_->begin_loop(sim);
        stop_.emplace(comm_, args_, scene_, *directory_, facts_.start);
        const double begin = wall_clock();
        try {
            outputs_->write_due(sim, sim.steps() == 0 ? -1 : sim.time(), sim.finished());
            while (!sim.finished()) {
                const double before = sim.time();
                const Requests asked = advance();
                for (const auto& words : outputs_->write_events(sim)) messages_.say(words);
                facts_.loop_seconds = wall_clock() - begin;
                facts_.peak_speed = std::max(facts_.peak_speed, sim.max_speed());
                outputs_->write_due(sim, before, sim.finished());
                if (!sim.finished()) show_status(false);
                if (asked.stop && !sim.finished()) {
                    write_checkpoint();
                    show_status(true);
                    outputs_->write_maps(sim);
                    ending().write(sim, *outputs_, "stopped", Exit::Stopped);
                    return say_stopped();
                }
                if (asked.checkpoint) write_checkpoint();
            }
            write_checkpoint();
        } catch (const NumbersFailed& e) {
            facts_.loop_seconds = wall_clock() - begin;
            show_status(true);
            throw NumbersFailed(keep_failure(e.what()));
        }
        show_status(true);
        ending().write(sim, *outputs_, "finished", Exit::Ok);
        ending().say_finished(sim, *outputs_);
        return Exit::Ok;
    }

    /// One step; where it fails and the scene allows it, back and on with half the step.
    Requests advance()
    {
        const Requests mine = stop_->now();
        try {
            return sim_->step(mine);
        } catch (const NumbersFailed& e) {
            const double time = sim_->time();
            const std::int64_t step = sim_->steps();
            if (!sim_->roll_back()) throw;
            outputs_->take_back(*sim_);
            facts_.retries.push_back({{"failed_time", time}, {"failed_step", step}, {"from_time", sim_->time()}, {"message", e.what()}});
            messages_.say(fmt::format("retry: {}. Back to t = {:g} s, on with half the step", e.what(), sim_->time()));
            return {};
        }
    }

    void show_status(bool final)
    {
        if (!messages_.due(final)) return;
        messages_.show({sim_->time(), sim_->steps(), sim_->dt(), sim_->max_speed(), outputs_->residual(), outputs_->fronts(),
                        scene_.dimensions, comm_.size(), sim_->balance().imbalance()},
                       final);
    }

    void write_checkpoint()
    {
        sim_->timers().timed(Phase::Checkpoint, [&] {
            outputs_->sync();
            checkpoints_->write(*sim_, facts_.peak_speed, outputs_->maps() ? &*outputs_->maps() : nullptr);
        });
        if (stop_) stop_->checkpoint_written();
    }

    // ---- how it ends

    Ending ending() { return {comm_, scene_, *directory_, messages_, facts_}; }

    Exit say_stopped()
    {
        messages_.say_aloud(fmt::format("stopped on request at t = {:g} s, step {}; checkpoint {} (go on with --restart)", sim_->time(),
                                        sim_->steps(), checkpoints_->last().string()));
        return Exit::Stopped;
    }

    /// Keeps the state whose numbers failed, as far as that works; gives the whole message.
    std::string keep_failure(std::string text)
    {
        try {
            outputs_->write_failure(*sim_);
            text += fmt::format(". The moment is in the last snapshot of {}", directory_->snapshots().string());
            text += checkpoints_->last_in_words();
            ending().write(*sim_, *outputs_, "numbers failed", Exit::NumbersFailed, text);
        } catch (const IoFailed& io) {
            text += fmt::format(". It could not be saved: {}", io.what());
        }
        return text;
    }

    const Comm& comm_;
    RunArguments args_;
    int threads_;
    Scene scene_;
    scene::Issues scene_warnings_;
    std::optional<scene::Filling> filling_; // until the simulation has it
    Messages messages_;
    RunFacts facts_;
    std::optional<io::ResultDirectory> directory_;
    std::optional<Checkpoints> checkpoints_;
    std::unique_ptr<Simulation> sim_;
    std::optional<Outputs> outputs_;
    std::optional<StopRequests> stop_;
};

} // namespace

Exit run_scene(const Comm& comm, const RunArguments& a) { return Run(comm, a, a.scene.read(comm)).go(); }

} // namespace kuzure
