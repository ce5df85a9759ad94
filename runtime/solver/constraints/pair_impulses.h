// Persistent contact pairs: the impulses between the two points of each pair, carried between substeps for warm
// starting.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "runtime/math/vec.h"
#include "runtime/solver/constraints/contact_search.h"
#include "runtime/solver/constraints/sleep.h"

namespace rapid {

// Interface of a Coupling that starts a substep with the impulses of the previous one and acts alongside rods and
// springs.
class CarriedImpulses {
public:
    virtual ~CarriedImpulses() = default;

    // Is called before warm_start(). islands: by point; points linked by rods and springs share a number. Empty if
    // there are no rods or springs. Valid for the substep.
    virtual void follow_rods(std::span<const std::uint32_t> islands) = 0;
    // Is called before the first substep of a frame. pairs: sorted, those that rods and springs join; they do not
    // collide. Valid for the frame.
    virtual void exclude(std::span<const std::array<std::uint32_t, 2>> pairs) = 0;
};

using ContactPair = std::array<std::uint32_t, 2>;  // indices of points

struct PairImpulses {
    std::vector<ContactPair> pairs;
    std::vector<float> normal;      // N s, along the normal, at least 0
    std::vector<Vec3f> tangential;  // N s, of friction on the first point
    // N s, on the first point: the total impulse at the end of the last frame in which both were awake. Empty until
    // points may sleep.
    std::vector<Vec3f> resting;
    std::vector<Vec3f> rolling;  // N m s, of rolling friction on the first point; empty if points do not turn

    // Scales all impulses, so that a substep of another length starts with the same forces.
    void scale(float factor);

    // Updates point indices to index[old]; IdIndex::none marks removed points. Pairs that lost a point are dropped;
    // their other point is added to `orphans` if it was pressed. The remaining pairs ascend.
    void renumber(std::span<const std::uint32_t> index, std::vector<std::uint32_t>& orphans);

    // Copies the impulses of pairs from before a search that are still listed; pairs[slot[k]] is the k-th of the list.
    // Pairs missing from the list were moved apart by a node: sleepers among them wake.
    void take_over(const PairImpulses& before, const Pairs& list, std::span<const std::uint32_t> slot, Sleep* sleep);

    // Replaces the pairs after the first `listed` by these, which ascend, and by the earlier ones under pressure.
    // Returns false if nothing changes.
    bool set_unlisted(std::size_t listed, std::span<const ContactPair> found);
};

}  // namespace rapid
