// The lives of single points: birth, changes by each node, forces, contacts, sleep, and the cause of death.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "runtime/graph/evaluate.h"

namespace rapid {

// All attributes of a point; groups are 0 or 1 as group:NAME.
using PointValues = std::map<std::string, AttributeValue>;

struct Biography {
    std::int64_t id = 0;
    std::string simulation;  // the name of its create

    struct Moment {
        std::int64_t frame;
        double time;  // s since the start
        Vec3f P, v;   // m, m/s
        std::string node, why;
    };
    struct Edit {
        std::string node;
        std::map<std::string, std::pair<AttributeValue, AttributeValue>> changes;  // before and after
        bool removed = false;  // from the output, after Solve; the simulation retains it
    };
    struct Force {
        std::string node;
        Vec3d a;  // m/s², on the point as it enters Solve
    };
    struct Contact {
        std::string node;  // of the collider
        double time, speed, impulse;
        Vec3f P, normal;
    };
    // A step of the simulation; a frame with sub-frames has several.
    struct Step {
        std::int64_t frame;
        double time;  // its end, s since the start
        std::vector<Edit> edits;
        std::vector<Force> forces;
        std::vector<Contact> contacts;
        bool asleep = false;                // when it entered Solve
        bool has_contacts = true;           // false with a tolerance in Solve, when contacts are unknown
        std::optional<PointValues> values;  // at its end; nothing if the point has died
    };

    std::optional<Moment> birth, death;
    std::vector<Step> steps;  // from birth to death
};

// Follows points through a run, which it must see from its first frame on. The plan has to keep steps
// (PlanOptions::keep_steps).
class Biographer {
public:
    // ids: points in each simulation, or in that of one create node. Throws Error if that does not exist.
    Biographer(const Plan& plan, const std::vector<std::int64_t>& ids, const std::string& create = {});

    // Called before the first frame.
    void watch(Evaluator& evaluator);
    // Returns the hook for the evaluator's constructor.
    Evaluator::ResultHook results();
    // Called after each frame.
    void add(const FrameResult& result);

    // Returns the lives of the points that were born, by simulation, in the order of the ids.
    std::vector<Biography> lives() const;

private:
    struct Followed {
        Biography life;
        std::size_t simulation;
        std::vector<Biography::Step> steps;  // of this frame
        std::optional<PointValues> before;   // as it entered the node that is being evaluated
        bool alive = false;
    };
    struct KnownCollider {
        std::string node;
        bool kills;
    };
    // Calls f for each followed point that may be among a node's points.
    template <class F>
    void for_each_of(const Node& node, const F& f);
    void enter(const Node& node, const Frame& frame, std::span<const Flow> inputs);
    void leave(const Node& node, const PointSet& points);
    void enter_solve(Followed& followed, const Node& node, const Frame& frame, const Flow& flow, std::size_t i) const;
    void record_birth(Followed& followed, const std::string& node) const;
    void die(Followed& followed, const std::string& node, std::string why) const;
    void note_record(Followed& followed, const StepRecord& record, Biography::Step& step) const;

    const Plan& plan_;
    std::map<const Node*, std::size_t> places_;  // in the plan
    std::vector<Followed> followed_;
    std::vector<std::vector<KnownCollider>> colliders_;  // by simulation, in the order of the chain
};

// Return the lives as text with a line per event, and as JSON.
std::string to_text(const std::vector<Biography>& lives);
std::string to_json(const std::vector<Biography>& lives);

}  // namespace rapid
