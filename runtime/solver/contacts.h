// Contacts between points: spheres that keep each other out, rub and bounce (paper §5.1; Macklin et al. 2014).
//
//   C = |P_i - P_j| - (r_i + r_j) >= 0
//
// A row is satisfied by Gauss-Seidel from where the sub-step before has left it: its impulse, along the normal and by
// friction, is applied at once, and what the sweeps do is only what has changed. A pile at rest is then solved before
// it is iterated, by one sweep a sub-step, however high it is; without that it would sink by 2 N g dt².
//
// An overlap that was there at the sub-step's beginning is not to be made deeper; what there is of it is taken away
// without giving speed. So points that are born in one another part, and do not fly.
//
// With mass_scaling, points count as lighter the higher they are: fewer sweeps then hold a stack, but what is hit from
// above or below does not keep its momentum.
//
// A sleeper (sleep.h) that is hit wakes before the sub-step is solved, and so do those that the shock reaches: each
// passes half of it on to those that it touches. One that is borne or pressed otherwise than when it fell asleep wakes
// after.
//
// Rows are ordered by blocks of space, of which every eighth is solved at the same time: neighbours never are, so that
// the result is the same bits on any number of threads, and momentum is kept.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "runtime/solver/constraint.h"
#include "runtime/solver/contact_search.h"
#include "runtime/solver/searched_places.h"

namespace rapid {

struct ContactOptions {
    std::optional<PerPoint<float>> radius;  // the attribute pscale where the points have it, else 0
    PerPoint<float> bounce{0.0f};           // ε in [0, 1]; of two points the larger
    PerPoint<float> friction{0.0f};         // μ >= 0; of two points the geometric mean
    std::optional<double> max_difference;   // m; a quarter of the largest radius
    int max_grids = 8;
    double mass_scaling = 0;  // at least 0: a point counts as e^mass_scaling times lighter than what it stands on
};

class Contacts : public Coupling {
public:
    // Takes over what it knows of the points that it has met before, by id. Error: a radius that is negative or not
    // finite, with the point's id; an attribute is missing.
    void follow(const PointSet& points, const ContactOptions& options, const std::string& group);

    void tie(std::span<std::uint8_t> tied) const override
    {
        for (const std::uint32_t i : roused_) tied[i] = 1;
    }
    void rouse(Substep& now) override;
    void prepare(Substep& now) override;
    void project(Substep& now) override;
    void settle(Substep& now) override;
    void take_back(Substep& now) override;
    Residual close(Substep& now) override;

private:
    using Pair = std::array<std::uint32_t, 2>;

    // A pair that touches in this sub-step. A cache line holds it.
    struct Row {
        std::uint32_t i, j, pair;
        float reach;          // m: r_i + r_j
        float allowed;        // m: the overlap at the beginning of the sub-step, at most 0
        float pressed, held;  // N s along n: by places, by velocities
        float friction;       // μ
        float leaves;         // m/s, along n: what a bounce gives it
        float per_w;          // kg: 1 / (w_i + w_j)
        Vec3f n;              // from j to i, unit
        Vec3f rubbed;         // N s, across n
    };

    template <class F>
    void each_batch(bool in_colours, const F& f);
    template <class F>
    void sweep(const F& f);
    template <class F>
    void weighed(const F& f);
    void touch(const Substep& now);
    bool enter(Row& row, std::uint32_t pair, double at_rest, const Substep& now);
    void scale_masses(Row& row, const Substep& now);
    bool shock(Substep& now);
    void disturb(const Row& row, const Substep& now) const;
    void keep_awake(std::span<const std::uint32_t> deep, const Substep& now) const;
    void search(const Substep& now);
    void schedule();
    void take_turns(std::size_t block);
    void take_over(const Substep& now);
    template <class Weights>
    void settle_once(Substep& now, bool last, const Weights& weights);
    void take_back(const Row& row, Substep& now) const;

    std::vector<float> radius_, root_friction_, bounce_;  // shape [size]; the radius is 0 of points that take no part
    float largest_ = 0, least_ = 0;
    double mass_scaling_ = 0;
    bool bounces_ = false, fresh_ = true, stale_ = true, backwards_ = false, uneven_ = false;
    RadiusGrids grids_{{nullptr, 0}, 0, 0, 1};
    ContactSearch search_;
    std::vector<std::int64_t> ids_;
    SearchedPlaces searched_;

    Pairs near_;                              // of the last search
    std::vector<std::uint32_t> slot_;         // of each of them, its place in the order of the sweeps:
    std::vector<Pair> pairs_, pairs_before_;  // colour by colour, block by block; and as they were in the search before
    // What each pair does to each other, as it is kept from sub-step to sub-step, N s: along the normal, and across it;
    // and both together at the end of the last frame in which both were awake, where any may sleep.
    std::vector<float> pressed_, pressed_before_;
    std::vector<Vec3f> rubbed_, rubbed_before_, borne_, borne_before_;
    std::vector<std::uint32_t> batches_;      // the beginning of each block's pairs, and the end
    std::vector<std::uint32_t> colours_;      // the beginning of each colour's blocks, and the end
    std::vector<Row> rows_;                   // of each block, at the place of its pairs
    std::vector<std::uint32_t> touching_in_;  // of each block, how many
    // Of each row, what its points' inverse masses are multiplied by; empty where masses are not scaled.
    std::vector<std::array<float, 2>> lightness_;

    // Of a search.
    std::vector<std::uint16_t> owner_;  // of each pair, its block
    std::vector<Pair> turn_;            // point and pair, block by block

    std::vector<std::uint32_t>
        roused_;                 // points that are not what they were, or have lost a neighbour that they pressed
    std::vector<double> shock_;  // N s, of each point

    double search_seconds_ = 0, per_dt_ = 0;
};

}  // namespace rapid
