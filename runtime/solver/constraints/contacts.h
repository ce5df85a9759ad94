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
// the result is the same bits on any number of threads, and momentum is kept. Those of a block are solved eight at
// once, packed so that no two of the eight share a point.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "runtime/solver/constraints/constraint.h"
#include "runtime/solver/constraints/contact_search.h"
#include "runtime/solver/constraints/gather.h"
#include "runtime/solver/constraints/neighbour_list.h"

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
    // finite, a friction below 0, with the point's id; an attribute is missing.
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

    // Eight pairs that touch in this sub-step and share no point: a row in each lane. Lanes beyond `rows` repeat the
    // first, and what comes of them is dropped.
    struct alignas(64) Octet {
        Indices i, j, pair;
        std::uint32_t rows;
        Floats reach;            // m: r_i + r_j
        Floats allowed;          // m: the overlap at the beginning of the sub-step, at most 0
        Floats pressed, held;    // N s along n: by places, by velocities
        Floats friction;         // μ
        Floats leaves;           // m/s, along n: what a bounce gives it
        Floats per_w;            // kg: 1 / (w_i + w_j)
        Floats lighter;          // what w_i is multiplied by, and w_j divided, where masses are scaled
        Vectors<Floats> n;       // from j to i, unit
        Vectors<Floats> rubbed;  // N s, across n

        // To all lanes but the first `rows`.
        void repeat_first()
        {
            for (std::uint32_t l = rows; l < lanes; ++l) i[l] = i[0], j[l] = j[0], pair[l] = pair[0];
        }
    };

    // One of them, for what is asked now and then.
    struct Row {
        std::uint32_t i, j, pair;
        double reach, allowed;
        Vec3d n;
    };

    template <class F>
    void each_batch(bool in_colours, const F& f);
    template <class F>
    void sweep(const F& f);
    template <class F>
    void each_row(const Octet& octet, const F& f) const;
    template <class F>
    void each_row(const F& f) const;
    template <class F>
    void weighed(const F& f);
    void touch(const Substep& now);
    bool may_touch(std::uint32_t pair, const Substep& now) const;
    void pack(std::span<const std::uint32_t> pairs, std::vector<Octet>& octets);
    void enter(Octet& octet, double at_rest, const Substep& now) const;
    void scale_masses(Octet& octet, const Places& a, const Places& b, const Substep& now) const;
    bool shock(Substep& now);
    Vec3f impulse(const Row& row) const;
    void disturb(const Row& row, const Substep& now) const;
    void bear(const Octet& octet, Substep& now) const;
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
    std::vector<float> reach_;                // m, of each pair, with room for a few lanes more
    std::vector<std::uint32_t> batches_;      // the beginning of each block's pairs, and the end
    std::vector<std::uint32_t> colours_;      // the beginning of each colour's blocks, and the end
    std::vector<std::vector<Octet>> octets_;  // of each block; beyond these kept for their memory
    bool scales_ = false;                     // masses, in this sub-step

    // Of a packing: the open octets up to the last that a point is in, by bits, if they are the same ones still.
    struct Taken {
        std::uint32_t window = 0;
        std::uint64_t octets = 0;
    };
    std::vector<Taken> taken_;
    std::vector<Vec3d> before_;  // places, before a sweep

    // Of a search.
    std::vector<std::uint16_t> owner_;  // of each pair, its block
    std::vector<Pair> turn_;            // point and pair, block by block

    std::vector<std::uint32_t>
        roused_;                 // points that are not what they were, or have lost a neighbour that they pressed
    std::vector<double> shock_;  // N s, of each point

    double search_seconds_ = 0, per_dt_ = 0;
};

}  // namespace rapid
