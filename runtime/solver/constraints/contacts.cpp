#include "runtime/solver/constraints/contacts.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>
#include <tbb/parallel_sort.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "runtime/parallel.h"
#include "runtime/points/members.h"
#include "runtime/solver/constraints/rows.h"
#include "runtime/stopwatch.h"

namespace rapid {
namespace {

// Of an overlap, what is taken away in a sub-step, and what is left as it is, as a part of the sum of the radii:
// contact that is just lost is gained anew in the next sub-step, and that is jitter.
constexpr double recovery = 0.8, left_over = 1e-4;

// And of an overlap with a sleeper: neither of two that hold a point between them gives way, and it would be pushed to
// and fro.
constexpr double recovery_asleep = 0.1;

// Where a sub-step leaves more than this part of the smaller radius, and the lighter of the two is borne, the heavier
// is taken back: iterations would have to be as many as the ratio of their masses.
constexpr double too_deep = 0.05;

// An overlap of which a sub-step leaves more than this part, where it takes away four fifths, is stuck.
constexpr double stuck = 0.9;

// Masses that differ by more than this factor are left to more than iterations.
constexpr double uneven = 2;

// Pairs that are as near as this, in parts of the sum of their radii, may come to touch in the projection.
constexpr double near = 1.02;

// A contact that closes by less than this many times what a point at rest is pressed by in a sub-step does not bounce.
constexpr double resting = 2;

// A sleeper wakes where what a neighbour does to it has changed by more than this part of its burden.
constexpr double disturbed = 0.1;

// Points that overlap by more than this part of the smaller radius do not fall asleep, nor do those that they lean on:
// they have to give way.
constexpr double too_deep_to_sleep = 0.05;

// Rows, and points with their pairs, a task: tens of microseconds.
constexpr std::size_t worth_a_task = 2048, points_a_task = 2048;

// Points in one place are parted somewhere, each pair elsewhere.
Vec3d somewhere(std::uint32_t i, std::uint32_t j)
{
    const std::uint32_t mixed = (i * 0x9e3779b9u) ^ (j * 0x85ebca6bu);
    return Vec3d(1.0 + (mixed & 255), 1.0 + (mixed >> 8 & 255), 1.0 + (mixed >> 16 & 255)).normalized();
}

}  // namespace

void Contacts::follow(const PointSet& points, const ContactOptions& options, const std::string& group)
{
    const std::size_t n = points.size();
    const Strided<float> radius = radii_of(options.radius, points);
    const Strided<float> friction = options.friction.read(points), bounce = options.bounce.read(points);
    const Strided<std::uint8_t> members = members_of(points, group);

    roused_.clear();
    const std::vector<float> before = std::move(radius_), rough_before = std::move(root_friction_);
    radius_.resize(n);
    root_friction_.resize(n);
    bounce_.resize(n);
    largest_ = 0, least_ = std::numeric_limits<float>::infinity();
    bounces_ = false;
    for (std::size_t i = 0; i < n; ++i) {
        if (!(radius[i] >= 0) || !std::isfinite(radius[i]))
            throw Error(fmt::format("point {}: its radius is {:g}; it must be finite and at least 0", points.id()[i],
                                    radius[i]));
        if (!(friction[i] >= 0))
            throw Error(
                fmt::format("point {}: its friction is {:g}; it must be at least 0", points.id()[i], friction[i]));
        radius_[i] = members[i] ? radius[i] : 0;
        root_friction_[i] = std::sqrt(friction[i]);
        bounce_[i] = bounce[i];
        bounces_ |= bounce[i] > 0;
        largest_ = std::max(largest_, radius_[i]);
        if (radius_[i] > 0) least_ = std::min(least_, radius_[i]);
    }
    const bool same_radii = radius_ == before;
    if (!same_radii)
        grids_ = RadiusGrids({radius_.data(), 1}, n, options.max_difference.value_or(largest_ / 4), options.max_grids);
    mass_scaling_ = options.mass_scaling;
    search_seconds_ = 0;
    fresh_ = true;

    // Pairs of points that are not there any more are forgotten; the others are known at their new places.
    const Strided<std::int64_t> id = points.id().read();
    const bool same = ids_.size() == n && std::equal(ids_.begin(), ids_.end(), id.data);
    std::vector<std::uint32_t> now(ids_.size());
    std::iota(now.begin(), now.end(), 0u);
    if (!same) {
        const PlacesById place(points.id());
        for (std::size_t i = 0; i < ids_.size(); ++i) now[i] = place[ids_[i]];
    }
    for (std::size_t k = 0; k < now.size(); ++k) {
        const std::uint32_t i = now[k];
        if (i != PlacesById::none && (radius_[i] != before[k] || root_friction_[i] != rough_before[k]))
            roused_.push_back(i);
    }
    stale_ |= !same || !same_radii;
    if (same) return;
    ids_.assign(id.data, id.data + n);
    struct Kept {
        Pair pair;
        float pressed;
        Vec3f rubbed, borne;
    };
    std::vector<Kept> kept;
    for (std::size_t s = 0; s < pairs_.size(); ++s) {
        if (!(pressed_[s] > 0)) continue;
        const std::uint32_t i = now[pairs_[s][0]], j = now[pairs_[s][1]];
        if (i == PlacesById::none && j != PlacesById::none) roused_.push_back(j);
        if (j == PlacesById::none && i != PlacesById::none) roused_.push_back(i);
        if (i == PlacesById::none || j == PlacesById::none) continue;
        const float way = i > j ? -1.0f : 1.0f;
        const Vec3f borne = borne_.empty() ? Vec3f(Vec3f::Zero()) : borne_[s];
        kept.push_back({{std::min(i, j), std::max(i, j)}, pressed_[s], way * rubbed_[s], way * borne});
    }
    std::sort(kept.begin(), kept.end(), [](const Kept& a, const Kept& b) { return a.pair < b.pair; });
    pairs_.clear();
    pressed_.clear();
    rubbed_.clear();
    const bool some_borne = !borne_.empty();
    borne_.clear();
    for (const auto& [pair, pressed, rubbed, borne] : kept) {
        pairs_.push_back(pair);
        pressed_.push_back(pressed);
        rubbed_.push_back(rubbed);
        if (some_borne) borne_.push_back(borne);
    }
    batches_.assign(1, 0);
    colours_.clear();
}

void Contacts::search(const Substep& now)
{
    const Stopwatch stopwatch;
    searched_.set(now, radius_, largest_, least_);
    std::swap(pairs_, pairs_before_);
    std::swap(pressed_, pressed_before_);
    std::swap(rubbed_, rubbed_before_);
    std::swap(borne_, borne_before_);
    search_.find(searched_.places(), {searched_.reach().data(), 1}, grids_, near_);
    schedule();
    take_over(now);
    search_seconds_ += stopwatch.seconds();
}

// What pairs have done to each other before the search. Where they are nowhere near any more, a node has moved one.
void Contacts::take_over(const Substep& now)
{
    const std::size_t m = pairs_.size();
    pressed_.assign(m, 0);
    rubbed_.assign(m, Vec3f::Zero());
    borne_.assign(borne_before_.empty() ? 0 : m, Vec3f::Zero());
    for_each_chunk(pairs_before_.size(), [&](std::size_t first, std::size_t last) {
        for (std::size_t s = first; s < last; ++s) {
            const bool pressed = pressed_before_[s] > 0;
            if (!pressed && (borne_.empty() || borne_before_[s].isZero(0))) continue;
            const auto [i, j] = pairs_before_[s];
            const auto here = near_.of(i);
            const auto found = std::lower_bound(here.begin(), here.end(), j);
            if (found == here.end() || *found != j) {
                if (pressed && now.sleepers) now.sleepers->wake(i), now.sleepers->wake(j);
                continue;
            }
            const std::uint32_t to = slot_[near_.begin[i] + static_cast<std::size_t>(found - here.begin())];
            pressed_[to] = pressed_before_[s];
            rubbed_[to] = rubbed_before_[s];
            if (!borne_.empty()) borne_[to] = borne_before_[s];
        }
    });
}

// Pairs go to the block of space that their points are in, or the least of the blocks along each axis: it then
// touches points of that block and of those after it. Blocks of the same colour, two apart along some axis, share none.
// Blocks that are 32 apart along an axis are taken as one.
void Contacts::schedule()
{
    const std::size_t n = radius_.size(), m = near_.size();
    constexpr std::size_t blocks = 8 * 16 * 16 * 16;
    owner_.resize(m);
    const auto find_owners = [&](std::size_t first, std::size_t last) {
        for (std::size_t i = first; i < last; ++i)
            for (std::uint32_t k = near_.begin[i]; k < near_.begin[i + 1]; ++k) {
                const auto &a = searched_.block(i), &b = searched_.block(near_.other[k]);
                std::uint32_t colour = 0, place = 0;
                for (int axis = 2; axis >= 0; --axis) {
                    const auto least = static_cast<std::uint32_t>(std::min(a[axis], b[axis]));
                    colour = colour << 1 | (least & 1);
                    place = place << 4 | (least >> 1 & 15);
                }
                owner_[k] = static_cast<std::uint16_t>(colour << 12 | place);
            }
    };
    for_each_chunk(n, find_owners, points_a_task);
    std::vector<std::uint32_t> next(blocks + 1);
    for (const std::uint16_t owner : owner_) ++next[owner + 1];
    std::partial_sum(next.begin(), next.end(), next.begin());
    batches_.clear();
    colours_.clear();
    for (std::size_t b = 0; b < blocks; ++b) {
        if (b % 4096 == 0) colours_.push_back(static_cast<std::uint32_t>(batches_.size()));
        if (next[b] < next[b + 1]) batches_.push_back(next[b]);
    }
    colours_.push_back(static_cast<std::uint32_t>(batches_.size()));
    batches_.push_back(static_cast<std::uint32_t>(m));
    turn_.resize(m);
    for (std::uint32_t i = 0; i < n; ++i)
        for (std::uint32_t k = near_.begin[i]; k < near_.begin[i + 1]; ++k) turn_[next[owner_[k]]++] = {i, k};

    pairs_.resize(m);
    slot_.resize(m);
    reach_.resize(m + lanes);
    if (octets_.size() < batches_.size()) octets_.resize(batches_.size());
    each_batch(false, [&](std::size_t b) { take_turns(b); });
}

// In each block the first pairs of all points, then the second, and so on: pairs that follow each other then seldom
// share a point, and the processor need not wait for one to begin the next.
void Contacts::take_turns(std::size_t block)
{
    thread_local std::vector<std::array<std::uint32_t, 2>> going;  // of each point, what is left of its pairs
    const std::uint32_t first = batches_[block], last = batches_[block + 1];
    going.clear();
    for (std::uint32_t t = first; t < last; ++t) {
        if (t == first || turn_[t][0] != turn_[t - 1][0]) going.push_back({t, t});
        going.back()[1] = t + 1;
    }
    std::uint32_t slot = first;
    while (!going.empty()) {
        std::size_t left = 0;
        for (auto [t, end] : going) {
            const auto [i, k] = turn_[t];
            slot_[k] = slot;
            reach_[slot] = static_cast<float>(double(radius_[i]) + double(radius_[near_.other[k]]));
            pairs_[slot++] = {i, near_.other[k]};
            going[left] = {t + 1, end};
            left += t + 1 < end;
        }
        going.resize(left);
    }
}

// Calls f(block) for all blocks: at the same time for those of a colour, or for all.
template <class F>
void Contacts::each_batch(bool in_colours, const F& f)
{
    const std::size_t colours = colours_.empty() ? 0 : colours_.size() - 1;
    const auto run = [&](std::size_t from, std::size_t to) {
        const std::size_t pairs = batches_[to] - batches_[from];
        if (pairs < worth_a_task) {
            for (std::size_t b = from; b < to; ++b) f(b);
            return;
        }
        const std::size_t grain = std::max<std::size_t>(1, (to - from) * worth_a_task / (2 * pairs));
        tbb::parallel_for(tbb::blocked_range<std::size_t>(from, to, grain),
                          [&](const tbb::blocked_range<std::size_t>& range) {
                              for (std::size_t b = range.begin(); b < range.end(); ++b) f(b);
                          });
    };
    if (!in_colours && colours > 0) return run(colours_.front(), colours_.back());
    for (std::size_t k = 0; k < colours; ++k) {
        const std::size_t c = backwards_ ? colours - 1 - k : k;
        run(colours_[c], colours_[c + 1]);
    }
}

// Forwards and backwards by turns: always in the same order, what a sweep leaves undone would add up on one side.
template <class F>
void Contacts::sweep(const F& f)
{
    each_batch(true, [&](std::size_t b) {
        std::vector<Octet>& octets = octets_[b];
        if (backwards_)
            std::for_each(octets.rbegin(), octets.rend(), f);
        else
            std::for_each(octets.begin(), octets.end(), f);
    });
}

template <class F>
void Contacts::each_row(const Octet& octet, const F& f) const
{
    for (std::uint32_t l = 0; l < octet.rows; ++l)
        f(Row{octet.i[l], octet.j[l], octet.pair[l], octet.reach[l], octet.allowed[l], octet.n[l]});
}

template <class F>
void Contacts::each_row(const F& f) const
{
    for (std::size_t b = 0; b + 1 < batches_.size(); ++b)
        for (const Octet& octet : octets_[b]) each_row(octet, f);
}

// Calls f(weights), where weights(octet, a, b) are the inverse masses of the rows' points, as the rows take them. Of
// another type where they are not scaled: that costs nothing.
template <class F>
void Contacts::weighed(const F& f)
{
    struct Weights {
        Doubles a, b;
    };
    if (!scales_)
        f([](const Octet&, const Places& a, const Places& b) { return Weights{a.w, b.w}; });
    else
        f([](const Octet& octet, const Places& a, const Places& b) {
            const Doubles lighter = widen(octet.lighter);
            return Weights{lighter * a.w, b.w / lighter};
        });
}

// The pairs that touch where their own ways end, or have pressed each other until now, become rows. Which these are is
// found first, without a branch: that would be mispredicted for every other pair.
void Contacts::touch(const Substep& now)
{
    const double at_rest = resting * now.pull * now.dt;
    scales_ = mass_scaling_ > 0 && !now.up.isZero(0);
    taken_.assign(now.size(), {});
    each_batch(true, [&](std::size_t b) {
        thread_local std::vector<std::uint32_t> close;
        const std::uint32_t first = batches_[b], last = batches_[b + 1];
        close.resize(last - first + lanes);
        std::size_t found = 0;
        for (std::uint32_t k = first; k < last; k += lanes) {
            const std::uint32_t count = std::min(lanes, last - k);
            Indices i, j;
            for (std::uint32_t l = 0; l < lanes; ++l) {
                const Pair& pair = pairs_[k + std::min(l, count - 1)];
                i[l] = pair[0], j[l] = pair[1];
            }
            Floats reach;
            std::memcpy(&reach, &reach_[k], sizeof reach);
            const Vectors<Doubles> d = gather(now.at, i).P - gather(now.at, j).P;
            const Doubles farthest = near * widen(reach);
            const std::uint64_t are_near = bytes(dot(d, d) <= farthest * farthest);
            for (std::uint32_t l = 0; l < count; ++l) {
                close[found] = k + l;
                found += (are_near >> 8 * l & 1) | (pressed_[k + l] > 0);
            }
        }
        const auto end = std::remove_if(close.begin(), close.begin() + static_cast<std::ptrdiff_t>(found),
                                        [&](std::uint32_t k) { return !may_touch(k, now); });
        pack({close.begin(), end}, octets_[b]);
        for (Octet& octet : octets_[b]) enter(octet, at_rest, now);
    });
}

// Whether the pair k has a row where it is near.
bool Contacts::may_touch(std::uint32_t k, const Substep& now) const
{
    const auto [i, j] = pairs_[k];
    if (!now.lives(i) || !now.lives(j)) return false;
    if (now.at[i].w + now.at[j].w > 0) return true;
    // What no constraint moves, and goes its way, wakes a sleeper in it.
    if (now.sleepers && now.v[i] != now.v[j]) now.sleepers->wake(i), now.sleepers->wake(j);
    return false;
}

// Each pair into the first octet with room that comes after those which its points are in: what comes of it is then
// what would come of one pair after the other, in their order. Octets are open by 64; a pair that finds none of them
// begins others, so that each takes the same time to find its own.
void Contacts::pack(std::span<const std::uint32_t> pairs, std::vector<Octet>& octets)
{
    octets.clear();
    std::uint32_t window = 0;  // the number of the open ones: 1 more than that of their first pair
    std::uint64_t room = 0;    // which of them have any
    std::size_t first = 0;
    for (const std::uint32_t k : pairs) {
        const auto [i, j] = pairs_[k];
        Taken &a = taken_[i], &b = taken_[j];
        const std::uint64_t taken = (a.window == window ? a.octets : 0) | (b.window == window ? b.octets : 0);
        std::uint64_t free = room & ~taken;
        if (free == 0) {
            window = k + 1;
            first = octets.size();
            free = room = ~std::uint64_t{0};
        }
        const auto o = static_cast<std::size_t>(std::countr_zero(free));
        if (first + o == octets.size()) octets.emplace_back().rows = 0;
        Octet& octet = octets[first + o];
        const std::uint32_t l = octet.rows++;
        octet.i[l] = i, octet.j[l] = j, octet.pair[l] = k;
        if (octet.rows == lanes) room &= ~(std::uint64_t{1} << o);
        a = b = {window, (std::uint64_t{2} << o) - 1};
    }
    for (Octet& octet : octets) octet.repeat_first();
}

// What the rows are, of pairs that are known.
void Contacts::enter(Octet& octet, double at_rest, const Substep& now) const
{
    const auto directions = [&](const Vectors<Doubles>& d) {
        const Doubles length = sqrt(dot(d, d));
        Vectors<Doubles> n = (1 / length) * d;
        if (any(!(length > 0)))
            for (std::uint32_t l = 0; l < lanes; ++l)
                if (!(length[l] > 0)) n.set(l, somewhere(octet.i[l], octet.j[l]));
        return n;
    };
    Doubles reach;
    Floats pressed, friction;
    Vectors<Floats> rubbed;
    for (std::uint32_t l = 0; l < lanes; ++l) {
        const std::uint32_t i = octet.i[l], j = octet.j[l], k = octet.pair[l];
        reach[l] = double(radius_[i]) + double(radius_[j]);
        pressed[l] = pressed_[k];
        friction[l] = root_friction_[i] * root_friction_[j];
        rubbed.x[l] = rubbed_[k].x(), rubbed.y[l] = rubbed_[k].y(), rubbed.z[l] = rubbed_[k].z();
    }
    const Places a = gather(now.at, octet.i), b = gather(now.at, octet.j);
    const Vectors<Doubles> apart = gather(now.begin, octet.i) - gather(now.begin, octet.j);
    octet.reach = narrow(reach);
    octet.allowed = narrow(least(sqrt(dot(apart, apart)) - reach, Doubles{}));
    octet.n = narrow(directions(a.P - b.P));
    octet.pressed = octet.held = 0.5f * pressed;
    octet.rubbed = rubbed - dot(octet.n, rubbed) * octet.n;
    octet.friction = friction;
    octet.per_w = narrow(1 / (a.w + b.w));
    if (scales_) scale_masses(octet, a, b, now);
    octet.leaves = Floats{};
    if (!bounces_) return;
    const Doubles approach = dot(directions(apart), gather(now.v, octet.i) - gather(now.v, octet.j));
    for (std::uint32_t l = 0; l < lanes; ++l)
        if (approach[l] < -at_rest)
            octet.leaves[l] = -std::max(bounce_[octet.i[l]], bounce_[octet.j[l]]) * static_cast<float>(approach[l]);
}

// With c = n·up, the upper point is taken as e^(k c) times lighter than the lower: in touch, as if mass fell by
// e^(-k h / (r_i + r_j)) with the height h (Macklin et al. 2014). The load then does not add up. A row bears
//
//   p = m g dt / (2 c sinh(k c / 2)),   as   w e^(k c / 2) c p = g dt + w e^(-k c / 2) c p
//
// under a stack of any height, w = 1/m. What is above that, as a fall leaves it, is not carried over: released, it
// would throw the light ones, as a whip does its end.
void Contacts::scale_masses(Octet& octet, const Places& a, const Places& b, const Substep& now) const
{
    for (std::uint32_t l = 0; l < lanes; ++l) {
        const double k = mass_scaling_, c = octet.n[l].dot(now.up), lighter = std::exp(0.5 * k * c);
        octet.lighter[l] = static_cast<float>(lighter);
        octet.per_w[l] = static_cast<float>(1 / (lighter * a.w[l] + b.w[l] / lighter));
        const double borne = now.pull * now.dt / ((c > 0 ? a.w[l] : b.w[l]) * std::abs(c * (lighter - 1 / lighter)));
        octet.pressed[l] = octet.held[l] = std::min(octet.pressed[l], static_cast<float>(0.5 * borne));
    }
}

void Contacts::rouse(Substep& now)
{
    if (per_dt_ > 0 && per_dt_ * now.dt != 1) {  // forces stay
        const auto scale = static_cast<float>(now.dt * per_dt_);
        for (float& pressed : pressed_) pressed *= scale;
        for (Vec3f& rubbed : rubbed_) rubbed *= scale;
        for (Vec3f& borne : borne_) borne *= scale;
    }
    per_dt_ = 1 / now.dt;
    if (fresh_) {
        double most = 0, least = std::numeric_limits<double>::infinity();
        for (const Place& at : now.at)
            if (at.w > 0) most = std::max(most, at.w), least = std::min(least, at.w);
        uneven_ = most > uneven * least;
    }
    if (stale_ || searched_.outrun(now)) search(now);
    fresh_ = stale_ = false;
    touch(now);
    if (now.sleepers && now.sleepers->any() && shock(now)) touch(now);
}

// Wakes the sleepers that are hit, and those that the shock reaches through what touches. They go the way that their
// weight gives them.
bool Contacts::shock(Substep& now)
{
    const double at_rest = resting * now.pull * now.dt;
    shock_.clear();
    each_row([&](const Row& row) {
        const bool first = now.asleep(row.i);
        if (first == now.asleep(row.j)) return;
        const double closing = -row.n.dot(now.v[row.i] - now.v[row.j]);
        if (closing < at_rest || row.n.dot(now.at[row.i].P - now.at[row.j].P) > row.reach) return;
        if (shock_.empty()) shock_.assign(now.size(), 0);
        const std::uint32_t hit = first ? row.i : row.j, by = first ? row.j : row.i;
        shock_[hit] = std::max(shock_[hit], closing / now.at[by].w);
    });
    if (shock_.empty()) return false;
    const auto moves = [&](std::size_t i) { return shock_[i] * now.sleepers->inverse_mass(i) >= at_rest; };
    for (bool spreads = true; spreads;) {
        spreads = false;
        for (const auto& [i, j] : pairs_) {
            for (const auto& [from, to] : {std::pair(i, j), std::pair(j, i)}) {
                if (!(0.5 * shock_[from] > shock_[to]) || !moves(from) || !now.asleep(to)) continue;
                const double reach = near * (double(radius_[i]) + double(radius_[j]));
                if ((now.at[i].P - now.at[j].P).squaredNorm() > reach * reach) continue;
                shock_[to] = 0.5 * shock_[from];
                spreads |= moves(to);
            }
        }
    }
    bool any = false;
    for (std::size_t i = 0; i < now.size(); ++i) {
        if (!now.asleep(i) || !moves(i)) continue;
        any = true;
        now.sleepers->rouse(i, now);
    }
    now.sleepers->rouse(now);
    return any;
}

// N s, on i.
Vec3f Contacts::impulse(const Row& row) const { return pressed_[row.pair] * row.n.cast<float>() + rubbed_[row.pair]; }

// Wakes the sleeper of a pair that is pressed otherwise than it was.
void Contacts::disturb(const Row& row, const Substep& now) const
{
    const bool first = now.asleep(row.i);
    if (first == now.asleep(row.j)) return;
    const std::uint32_t sleeper = first ? row.i : row.j;
    Vec3f change = impulse(row);
    if (!borne_.empty()) change -= borne_[row.pair];
    if (change.norm() > disturbed * now.dt * now.sleepers->burden(sleeper)) now.sleepers->wake(sleeper);
}

void Contacts::prepare(Substep& now)
{
    const double dt = now.dt;
    const auto each_point = [&](const auto& f) {
        for_each_chunk(now.size(), [&](std::size_t begin, std::size_t end) {
            for (std::size_t i = begin; i < end; ++i) f(i);
        });
    };
    before_.resize(now.size());
    each_point([&](std::size_t i) { before_[i] = now.at[i].P; });
    weighed([&](const auto& weights) {
        sweep([&](const Octet& octet) {
            if (!any(widen(octet.pressed) > 0)) return;
            Places a = gather(now.at, octet.i), b = gather(now.at, octet.j);
            const auto [wa, wb] = weights(octet, a, b);
            const Vectors<Doubles> half = widen(octet.pressed * octet.n + 0.5f * octet.rubbed);
            a.P += (wa * dt) * half;
            b.P -= (wb * dt) * half;
            scatter(a, now.at, octet.i, octet.rows);
            scatter(b, now.at, octet.j, octet.rows);
        });
    });
    each_point([&](std::size_t i) { now.v[i] += per_dt_ * (now.at[i].P - before_[i]); });
}

void Contacts::project(Substep& now)
{
    const double dt = now.dt, per_dt = per_dt_;
    weighed([&](const auto& weights) {
        sweep([&](Octet& octet) {
            Places a = gather(now.at, octet.i), b = gather(now.at, octet.j);
            const auto [wa, wb] = weights(octet, a, b);
            const Vectors<Doubles> n = widen(octet.n);
            const Doubles before = widen(octet.pressed);
            const Doubles C = dot(n, a.P - b.P) - widen(octet.reach) - widen(octet.allowed);
            const Doubles pressed = most(before - C * per_dt * widen(octet.per_w), Doubles{});
            const Doubles change = dt * (pressed - before);
            octet.pressed = narrow(pressed);
            a.P += (wa * change) * n;
            b.P -= (wb * change) * n;
            scatter(a, now.at, octet.i, octet.rows);
            scatter(b, now.at, octet.j, octet.rows);
        });
    });
}

// Normal velocities first: none into the other, or what bounces; then friction, by all that presses. What friction does
// it does throughout the sub-step, and so half of it to the places: else a point that is held would creep.
void Contacts::settle(Substep& now)
{
    for (int k = 1; k <= now.iterations; ++k) {
        backwards_ = !backwards_;
        weighed([&](const auto& weights) { settle_once(now, k == now.iterations, weights); });
    }
}

void Contacts::take_back(Substep& now)
{
    if (uneven_) sweep([&](const Octet& octet) { each_row(octet, [&](const Row& row) { take_back(row, now); }); });
}

// A heavy point on a light one that a shape bears, itself or through others, would go through it: in a sweep the shape
// gives back no more than the lighter weighs. Where that has left it too deep it is taken back, with the lighter as a
// wall. So it is where it wedges a light one that something bears: what parts them moves the light one, and that is put
// back. Of its velocity what is its own into the lighter is taken off; a light one that is squeezed out, or thrown,
// does not give it more than weight takes, which is what a shape that lifts both has to.
void Contacts::take_back(const Row& row, Substep& now) const
{
    const bool first = now.at[row.i].w < now.at[row.j].w;  // is the heavier
    const std::uint32_t heavy = first ? row.i : row.j, light = first ? row.j : row.i;
    if (!(now.at[heavy].w > 0) || now.borne[light] == 0) return;
    const Vec3d d = now.at[heavy].P - now.at[light].P;
    const double distance = d.norm(), overlap = row.reach - distance;
    const double allowed = too_deep * std::min(radius_[row.i], radius_[row.j]), depth = overlap - allowed;
    if (!(depth > 0) || !(distance > 0)) return;
    const bool wedged =
        -row.allowed > allowed && overlap > stuck * -row.allowed && now.at[light].w > uneven * now.at[heavy].w;
    if (now.borne[light] <= now.borne[heavy] && !wedged) return;
    const Vec3d n = d / distance;
    now.at[heavy].P += depth * n;
    const double own = -n.dot(now.v[heavy]), closing = own + n.dot(now.v[light]);
    now.v[heavy] += std::clamp(closing, 0.0, std::max(own, resting * now.pull * now.dt)) * n;
}

template <class Weights>
void Contacts::settle_once(Substep& now, bool last, const Weights& weights)
{
    const double dt = now.dt;
    const bool watched = last && now.sleepers && now.sleepers->any();
    const auto solve = [&](Octet& octet) {
        Places a = gather(now.at, octet.i), b = gather(now.at, octet.j);
        const Vectors<Doubles> n = widen(octet.n), had = widen(octet.rubbed);
        const Doubles before = widen(octet.pressed) + widen(octet.held), reach = widen(octet.reach);
        const Doubles overlap = reach - dot(n, a.P - b.P), per_w = widen(octet.per_w);
        Vectors<Doubles> va = gather(now.v, octet.i), vb = gather(now.v, octet.j);

        const Vectors<Doubles> relative = va - vb;
        const Doubles closing = dot(n, relative);
        const Flags touches = (before > 0) | (overlap > 0);
        const Doubles p = touches ? most(before + (widen(octet.leaves) - closing) * per_w, Doubles{}) : Doubles{};
        const Vectors<Doubles> held = had - per_w * (relative - closing * n);
        const Doubles size = sqrt(dot(held, held)), bound = widen(octet.friction) * p;
        const Vectors<Doubles> rubbed = (bound < size ? bound / size : Doubles{} + 1) * held, change = rubbed - had;
        octet.pressed = narrow(p);
        octet.rubbed = narrow(rubbed);
        octet.held = Floats{};

        const Vectors<Doubles> push = (p - before) * n + change;
        Vectors<Doubles> shift = (0.5 * dt) * change;
        const auto [wa, wb] = weights(octet, a, b);
        va += wa * push;
        vb -= wb * push;
        if (last) {
            Doubles part = Doubles{} + recovery;
            if (watched)
                for (std::uint32_t l = 0; l < lanes; ++l)
                    if (now.asleep(octet.i[l]) || now.asleep(octet.j[l])) part[l] = recovery_asleep;
            shift += (part * most(overlap - left_over * reach, Doubles{}) * per_w) * n;
        }
        a.P += wa * shift;
        b.P -= wb * shift;
        scatter(a, now.at, octet.i, octet.rows);
        scatter(b, now.at, octet.j, octet.rows);
        scatter(va, now.v, octet.i, octet.rows);
        scatter(vb, now.v, octet.j, octet.rows);
        if (!last) return;
        for (std::uint32_t l = 0; l < octet.rows; ++l) {
            pressed_[octet.pair[l]] = octet.pressed[l];
            rubbed_[octet.pair[l]] = octet.rubbed[l].cast<float>();
        }
        if (uneven_) bear(octet, now);
        if (watched) each_row(octet, [&](const Row& row) { disturb(row, now); });
    };
    sweep(solve);
}

// What presses bears, as it is borne.
void Contacts::bear(const Octet& octet, Substep& now) const
{
    for (std::uint32_t l = 0; l < octet.rows; ++l) {
        if (!(octet.pressed[l] > 0)) continue;
        const std::uint32_t i = octet.i[l], j = octet.j[l];
        const std::uint8_t bi = now.borne[i], bj = now.borne[j];
        std::uint8_t &fi = now.found_borne[i], &fj = now.found_borne[j];
        fi = std::max<std::uint8_t>(fi, std::max<std::uint8_t>(bj, 1) - 1);
        fj = std::max<std::uint8_t>(fj, std::max<std::uint8_t>(bi, 1) - 1);
    }
}

// These, and all that they touch.
void Contacts::keep_awake(std::span<const std::uint32_t> deep, const Substep& now) const
{
    std::vector<std::uint8_t> is_deep(now.size());
    for (const std::uint32_t i : deep) is_deep[i] = 1;
    each_row([&](const Row& row) {
        if (!is_deep[row.i] && !is_deep[row.j]) return;
        for (const std::uint32_t i : {row.i, row.j}) now.sleepers->keep_awake(i);
    });
}

Residual Contacts::close(Substep& now)
{
    Residual result;
    std::vector<std::uint32_t> deep;
    if (now.sleepers && borne_.empty()) borne_.assign(pairs_.size(), Vec3f::Zero());
    const auto count = [&](std::uint32_t i, std::uint32_t j, double overlap, bool pressed) {
        if (!(overlap > 0) && !pressed) return;
        ++result.rows;
        result.worst = std::max(result.worst, overlap);
        result.loose += overlap > 0.1 * std::min(radius_[i], radius_[j]);
    };
    each_row([&](const Row& row) {
        if (now.asleep(row.i) && now.asleep(row.j)) return;
        const double overlap = row.reach - (now.at[row.i].P - now.at[row.j].P).norm();
        count(row.i, row.j, overlap, pressed_[row.pair] > 0);
        if (!now.sleepers) return;
        const Vec3f borne = impulse(row);
        for (const std::uint32_t of : {row.i, row.j}) now.sleepers->load(of, borne.norm() * per_dt_);
        if (overlap > too_deep_to_sleep * std::min(radius_[row.i], radius_[row.j]))
            deep.insert(deep.end(), {row.i, row.j});
        if (!now.asleep(row.i) && !now.asleep(row.j)) borne_[row.pair] = borne;
    });
    if (!deep.empty()) keep_awake(deep, now);
    // Pairs that sleep have no row.
    for (std::size_t k = 0; now.sleepers && k < pairs_.size(); ++k) {
        const auto [i, j] = pairs_[k];
        if (!now.asleep(i) || !now.asleep(j)) continue;
        count(i, j, double(radius_[i]) + double(radius_[j]) - (now.at[i].P - now.at[j].P).norm(), pressed_[k] > 0);
    }
    Residual::Search search{{}, grids_.error, grids_.excess, search_seconds_};
    for (const RadiusGrids::Grid& grid : grids_.grids) search.grids.push_back(grid.points);
    result.search = std::move(search);
    return result;
}

}  // namespace rapid
