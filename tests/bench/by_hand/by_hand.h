// Shared by hand-written programs, one for each of several scenes of graphs/, as fast as we can make them, for
// bench_table to compare with. They use single precision, columns of floats, dense tables of distances and two threads.
// They have no error messages, no audit and no order of points, and differ in their bits between runs on several
// threads.
//
//   by_hand_SCENE RATE FRAMES        simulates the frames from 1 on, and prints the moments of the last one's points
#pragma once

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <memory>
#include <new>
#include <thread>
#include <utility>
#include <vector>

namespace by_hand {

constexpr float frame_time = 1.0f / 24, gravity = 9.81f;
constexpr std::size_t block = 256, chunk = 8192;

// Calls f(begin, end) for parts of [0, n), on two threads.
template <class F>
void in_parallel(std::size_t n, const F& f)
{
    std::atomic<std::size_t> next{0};
    const auto work = [&] {
        for (std::size_t begin; (begin = next.fetch_add(chunk)) < n;) f(begin, std::min(n, begin + chunk));
    };
    if (n <= chunk) return work();
    std::thread other(work);
    work();
    other.join();
}

// PCG (O'Neill 2014), 32 bits of 64.
class Random {
public:
    explicit Random(std::uint64_t seed) : state_(seed * 0x9e3779b97f4a7c15u + 0x853c49e6748fea9bu) { next(); }
    float next()
    {
        const std::uint64_t old = state_;
        state_ = old * 6364136223846793005u + 1442695040888963407u;
        const auto word = static_cast<std::uint32_t>((old ^ (old >> 22)) >> (22 + (old >> 61)));
        return static_cast<float>(word >> 8) * 0x1p-24f;
    }

private:
    std::uint64_t state_;
};

struct V {
    float x, y, z;
};
inline V operator+(V a, V b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline V operator-(V a, V b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline V operator*(float s, V a) { return {s * a.x, s * a.y, s * a.z}; }
inline float dot(V a, V b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline float length(V a) { return std::sqrt(dot(a, a)); }

// Turns a vector uniformly within a cone and keeps its length.
inline V turned(V mean, float half_angle, Random& random)
{
    const float size = length(mean);
    const V d = (1 / size) * mean;
    const float sine = std::sin(0.5f * half_angle), fall = 2 * sine * sine * random.next();
    const float side = std::sqrt(fall * (2 - fall)), angle = 6.2831853f * random.next();
    const float sign = std::copysign(1.0f, d.z), a = -1 / (sign + d.z), b = d.x * d.y * a;
    const V e1{1 + sign * d.x * d.x * a, sign * b, -sign * d.x}, e2{b, sign + d.y * d.y * a, -d.y};
    return size * ((1 - fall) * d + side * (std::cos(angle) * e1 + std::sin(angle) * e2));
}

// The triangles of a torus about the y axis, as in rapid.mesh.torus with 24 divisions.
class TorusMesh {
public:
    struct Place {
        V P, N;
    };

    TorusMesh(float radius, float tube, V center)
    {
        const int across = std::max(3, static_cast<int>(std::lround(divisions * tube / radius)));
        const auto at = [&](int i, int j) {
            const float u = 6.2831853f * static_cast<float>(i) / divisions;
            const float w = 6.2831853f * static_cast<float>(j) / static_cast<float>(across);
            const float wide = radius + tube * std::cos(w);
            return center + V{wide * std::cos(u), tube * std::sin(w), wide * std::sin(u)};
        };
        for (int i = 0; i < divisions; ++i)
            for (int j = 0; j < across; ++j) {
                add(at(i, j), at(i, j + 1), at(i + 1, j + 1));
                add(at(i, j), at(i + 1, j + 1), at(i + 1, j));
            }
    }

    // Picks a point uniformly by area.
    Place place(Random& random) const
    {
        const float area = random.next() * triangles_.back().area;
        const auto t = std::upper_bound(triangles_.begin(), triangles_.end() - 1, area,
                                        [](float a, const Triangle& b) { return a < b.area; });
        const float side = std::sqrt(random.next()), along = random.next() * side;
        return {t->P + (side - along) * t->a + along * t->b, t->N};
    }

private:
    static constexpr int divisions = 24;

    struct Triangle {
        V P, a, b, N;
        float area;  // including those before
    };

    void add(V P, V Q, V R)
    {
        const V a = Q - P, b = R - P, n{a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
        triangles_.push_back(
            {P, a, b, 1 / length(n) * n, 0.5f * length(n) + (triangles_.empty() ? 0 : triangles_.back().area)});
    }

    std::vector<Triangle> triangles_;
};

// Columns of floats with room for all points of the run. The last points replace those that died in a frame.
template <int columns>
class Points {
public:
    explicit Points(std::size_t room) : room_((room + 2 * chunk) / chunk * chunk + 64)
    {
        // Staggered columns: at the same offset within their pages they would compete for the same cache sets.
        memory_ = static_cast<float*>(std::aligned_alloc(64, sizeof(float) * (columns * (room_ + 1040) + 1024)));
        if (!memory_) throw std::bad_alloc();
    }
    ~Points() { std::free(memory_); }
    Points(const Points&) = delete;
    Points& operator=(const Points&) = delete;

    float* operator[](int column) const { return memory_ + static_cast<std::size_t>(column) * (room_ + 1040); }
    std::size_t size() const { return size_; }
    std::size_t append(std::size_t n)
    {
        if (size_ + n > room_) throw std::bad_alloc();
        return std::exchange(size_, size_ + n);
    }
    // Ascending.
    void remove(const std::vector<std::uint32_t>& dead)
    {
        std::size_t last = dead.size();
        for (std::size_t hole = 0; hole < last; ++hole) {
            while (last > hole && dead[last - 1] == size_ - 1) --last, --size_;
            if (last <= hole) break;
            --size_;
            for (int c = 0; c < columns; ++c) (*this)[c][dead[hole]] = (*this)[c][size_];
        }
    }

private:
    float* memory_;
    std::size_t room_, size_ = 0;
};

// Collects results of several threads, chunk by chunk.
class Dead {
public:
    void begin(std::size_t points) { chunks_.resize((points + chunk - 1) / chunk); }
    std::vector<std::uint32_t>& of(std::size_t first) { return chunks_[first / chunk]; }
    const std::vector<std::uint32_t>& all()
    {
        all_.clear();
        for (std::vector<std::uint32_t>& some : chunks_) {
            all_.insert(all_.end(), some.begin(), some.end());
            some.clear();
        }
        return all_;
    }

private:
    std::vector<std::vector<std::uint32_t>> chunks_;
    std::vector<std::uint32_t> all_;
};

// A dense table of signed distances.
class Distances {
public:
    template <class F>
    Distances(V low, V high, float voxel, const F& distance) : low_(low), per_(1 / voxel), margin_(0.88f * voxel)
    {
        const auto count = [&](float a, float b) { return static_cast<int>(std::ceil((b - a) / voxel)) + 1; };
        nx_ = count(low.x, high.x), ny_ = count(low.y, high.y), nz_ = count(low.z, high.z);
        table_.resize(static_cast<std::size_t>(nx_) * ny_ * nz_);
        for (int k = 0; k < nz_; ++k)
            for (int j = 0; j < ny_; ++j)
                for (int i = 0; i < nx_; ++i)
                    table_[at(i, j, k)] = distance(V{low.x + i * voxel, low.y + j * voxel, low.z + k * voxel});
    }

    // Returns a distance within which there is no surface, from the nearest entry.
    float clearance(float x, float y, float z) const
    {
        const auto nearest = [](float u, int n) {
            return static_cast<int>(std::min(std::max(u + 0.5f, 0.0f), static_cast<float>(n) - 0.5f));
        };
        const int i = nearest((x - low_.x) * per_, nx_), j = nearest((y - low_.y) * per_, ny_),
                  k = nearest((z - low_.z) * per_, nz_);
        return table_[at(i, j, k)] - margin_;
    }
    // Trilinear interpolation; outside of the table, a lower bound.
    float distance(float x, float y, float z) const
    {
        const auto into = [](float u, int n) { return std::min(std::max(u, 0.0f), static_cast<float>(n) - 1.001f); };
        const float u = into((x - low_.x) * per_, nx_), v = into((y - low_.y) * per_, ny_),
                    w = into((z - low_.z) * per_, nz_);
        const int i = static_cast<int>(u), j = static_cast<int>(v), k = static_cast<int>(w);
        const float f = u - static_cast<float>(i), g = v - static_cast<float>(j), h = w - static_cast<float>(k);
        const float* t = table_.data();
        const int a = (k * ny_ + j) * nx_ + i, b = a + nx_, c = a + nx_ * ny_, d = c + nx_;
        return mixed(mixed(mixed(t[a], t[a + 1], f), mixed(t[b], t[b + 1], f), g),
                     mixed(mixed(t[c], t[c + 1], f), mixed(t[d], t[d + 1], f), g), h);
    }
    V normal(V P) const
    {
        const Cell c = cell(P);
        const float *a = &table_[c.at], *b = a + nx_ * ny_;
        const auto along_x = [&](const float* p) { return mixed(p[1] - p[0], p[nx_ + 1] - p[nx_], c.f.y); };
        const auto along_y = [&](const float* p) { return mixed(p[nx_] - p[0], p[nx_ + 1] - p[1], c.f.x); };
        const auto value = [&](const float* p) {
            return mixed(mixed(p[0], p[1], c.f.x), mixed(p[nx_], p[nx_ + 1], c.f.x), c.f.y);
        };
        const V g{mixed(along_x(a), along_x(b), c.f.z), mixed(along_y(a), along_y(b), c.f.z), value(b) - value(a)};
        return (1 / (length(g) + 1e-20f)) * g;
    }

private:
    struct Cell {
        std::size_t at;
        V f;
    };
    static float mixed(float a, float b, float f) { return a + f * (b - a); }
    std::size_t at(int i, int j, int k) const { return (static_cast<std::size_t>(k) * ny_ + j) * nx_ + i; }
    Cell cell(V P) const
    {
        const V u = per_ * (P - low_);
        const auto into = [](float x, int n) { return std::min(std::max(x, 0.0f), static_cast<float>(n) - 1.001f); };
        const V in{into(u.x, nx_), into(u.y, ny_), into(u.z, nz_)};
        const int i = static_cast<int>(in.x), j = static_cast<int>(in.y), k = static_cast<int>(in.z);
        return {at(i, j, k), {in.x - i, in.y - j, in.z - k}};
    }

    V low_;
    float per_, margin_;
    int nx_, ny_, nz_;
    std::vector<float> table_;
};

// Bounces a point off a surface, and lets it rest if all further bounces would end within the time.
struct Surface {
    float bounce, friction;

    // Returns true if the point rests from now on, on a surface with the normal n, under a pull towards it.
    bool respond(V& v, V n, float pull, float time) const
    {
        const float vn = dot(v, n);
        if (vn >= 0) return false;
        const V vt = v - vn * n;
        const float side = length(vt);
        const float left = side > 0 ? std::max(0.0f, 1 + friction * (1 + bounce) * vn / side) : 0;
        const float up = -bounce * vn;
        const bool rests = pull > 0 && 2 * up <= pull * (1 - bounce) * time;
        if (rests) {
            const float kept = side > 0 ? std::max(0.0f, 1 + friction * vn / side) : 0;
            v = kept * vt;
        } else {
            v = left * vt + up * n;
        }
        return rests;
    }
    // Slides a point along a surface under an acceleration, for a time.
    void slide(V& P, V& v, V n, V a, float time) const
    {
        const float pull = -dot(a, n);
        V at = a + pull * n;
        const float size = length(v), hold = friction * pull;
        if (size > 0) {
            const V d = (1 / size) * v;
            const V slowed = at - hold * d;
            const float along = dot(slowed, d);
            if (along < 0 && size + along * time <= 0) {
                const float stops = -size / along;
                P = P + 0.5f * stops * v;
                v = {0, 0, 0};
                time -= stops;
            } else {
                P = P + time * (v + 0.5f * time * slowed);
                v = v + time * slowed;
                return;
            }
        }
        const float drawn = length(at);
        if (drawn <= hold) return;
        at = (1 - hold / drawn) * at;
        P = P + 0.5f * time * time * at;
        v = time * at;
    }
};

// Returns the time at which a point meets a floor that it is pulled towards, within the time.
inline float to_floor(float height, float vy, float pull, float time)
{
    const float at = (vy + std::sqrt(std::max(0.0f, vy * vy + 2 * pull * height))) / pull;
    return std::min(time, std::max(0.0f, at));
}

// A fall above a floor, without branches, for vectors of points: a miss, one bounce, or a slide to rest. Returns true,
// and leaves the point unchanged, if it would bounce again.
inline bool fall(const Surface& floor, float radius, float time, float& x, float& y, float& z, float& vx, float& vy,
                 float& vz)
{
    constexpr float g = gravity, tiny = 1e-20f;
    const float h = y - radius, missed = h + time * (vy - 0.5f * g * time);
    const bool hits = missed < 0;
    const float into = std::sqrt(std::max(0.0f, vy * vy + 2 * g * h)), up = floor.bounce * into;
    const float flies = std::min(time, std::max(0.0f, (vy + into) * (1 / g))), left = time - flies;
    const bool rests = 2 * up <= g * (1 - floor.bounce) * left;
    const float side = std::sqrt(vx * vx + vz * vz), taken = floor.friction * into / (side + tiny);
    const float bounced = std::max(0.0f, 1 - (1 + floor.bounce) * taken), laid = std::max(0.0f, 1 - taken);
    const float slides = side * laid, hold = floor.friction * g;
    const float at_end = std::max(0.0f, 1 - hold * left / (slides + tiny));
    const float along = laid * std::min(left, slides * (1 / hold)) * 0.5f * (1 + at_end);
    const float height = left * (up - 0.5f * g * left), rises = up - g * left;
    const bool again = hits & !rests & (height < 0);
    float way = rests ? flies + along : flies + bounced * left, keeps = rests ? laid * at_end : bounced;
    float y1 = rests ? 0 : height, vy1 = rests ? 0 : rises;
    way = hits ? way : time, keeps = hits ? keeps : 1, y1 = hits ? y1 : missed, vy1 = hits ? vy1 : vy - g * time;
    way = again ? 0 : way, keeps = again ? 1 : keeps;
    x += vx * way, z += vz * way;
    vx *= keeps, vz *= keeps;
    y = again ? y : radius + y1;
    vy = again ? vy : vy1;
    return again;
}

// A fall from bounce to bounce.
inline void bounce(const Surface& floor, float radius, float time, V& P, V& v)
{
    const V a{0, -gravity, 0};
    for (int bounces = 0; bounces < 16; ++bounces) {
        const float s = to_floor(P.y - radius, v.y, gravity, time);
        P = P + s * (v + 0.5f * s * a);
        v = v + s * a;
        time -= s;
        if (time <= 0) return;
        P.y = radius;
        if (floor.respond(v, {0, 1, 0}, gravity, time)) return floor.slide(P, v, {0, 1, 0}, a, time);
    }
}

// A table as a field that does not change with time.
struct StaticField {
    const Distances& table;

    float clearance(float x, float y, float z) const { return table.clearance(x, y, z); }
    float distance(float x, float y, float z, float) const { return table.distance(x, y, z); }
    V normal(V P, float) const { return table.normal(P); }
    V velocity(V) const { return {0, 0, 0}; }
    static constexpr float fastest = 0;  // m/s, of the surface
};

// The points of a block that approach a field of distances, on their paths from contact to contact. All advance
// together.
class Walkers {
public:
    void add(int point, V P, V v, V a, float time)
    {
        point_[n_] = point, x_[n_] = P.x, y_[n_] = P.y, z_[n_] = P.z, vx_[n_] = v.x, vy_[n_] = v.y, vz_[n_] = v.z;
        ax_[n_] = a.x, ay_[n_] = a.y, az_[n_] = a.z, begun_[n_] = 0, left_[n_++] = time;
    }

    // Calls done(point, P, v) once for each point.
    template <class Field, class Done>
    void walk(const Field& field, float radius, const Surface& body, const Surface& floor, const Done& done)
    {
        for (int contacts = 0; n_ > 0; ++contacts) {
            find_contacts(field, radius);
            int kept = 0;
            for (int i = 0; i < n_; ++i) {
                const float s = s_[i], now = begun_[i] + s, left = left_[i] - s;
                const V a{ax_[i], ay_[i], az_[i]};
                V P{x_[i], y_[i], z_[i]}, v{vx_[i], vy_[i], vz_[i]};
                P = P + s * (v + 0.5f * s * a);
                v = v + s * a;
                bool ends = contacts >= 16;
                if (inside_[i]) {
                    const V n = field.normal(P, now), carried = field.velocity(P);
                    v = v - carried;
                    if (body.respond(v, n, -dot(a, n), left)) {
                        body.slide(P, v, n, a, left);
                        P = P + left * carried;
                        keep_on(field, radius, n, P, v, a, now + left, left);
                        ends = true;
                    }
                    v = v + carried;
                } else if (s >= lands_[i] && left > 0) {
                    P.y = radius;
                    if (floor.respond(v, {0, 1, 0}, -a.y, left)) {
                        floor.slide(P, v, {0, 1, 0}, a, left);
                        ends = true;
                    }
                } else {
                    ends = true;
                }
                if (ends) {
                    done(point_[i], P, v);
                    continue;
                }
                point_[kept] = point_[i], begun_[kept] = now, left_[kept] = left;
                x_[kept] = P.x, y_[kept] = P.y, z_[kept] = P.z, vx_[kept] = v.x, vy_[kept] = v.y, vz_[kept] = v.z;
                ax_[kept] = a.x, ay_[kept] = a.y, az_[kept] = a.z;
                ++kept;
            }
            n_ = kept;
        }
    }

private:
    // Projects points that slid along the tangent back onto the surface, unless it has moved away or ended.
    template <class Field>
    static void keep_on(const Field& field, float radius, V before, V& P, V& v, V a, float now, float slid)
    {
        const V n = field.normal(P, now);
        const float above = field.distance(P.x, P.y, P.z, now) - radius;
        if (above > -0.5f * dot(a, n) * slid * slid || dot(n, before) < 0.9f) return;
        P = P - above * n;
        const float fast = length(v);
        v = v - dot(v, n) * n;
        v = (fast / (length(v) + 1e-20f)) * v;
    }

    template <class Field>
    void find_contacts(const Field& field, float radius)
    {
        constexpr float flush = 1e-5f;
        const auto height = [&](int i, float s) {
            return field.distance(x_[i] + s * (vx_[i] + 0.5f * s * ax_[i]), y_[i] + s * (vy_[i] + 0.5f * s * ay_[i]),
                                  z_[i] + s * (vz_[i] + 0.5f * s * az_[i]), begun_[i] + s) -
                   radius;
        };
#pragma omp simd
        for (int i = 0; i < n_; ++i) {
            lands_[i] = to_floor(y_[i] - radius, vy_[i], std::max(1e-3f, -ay_[i]), left_[i]);
            const float v = std::sqrt(vx_[i] * vx_[i] + vy_[i] * vy_[i] + vz_[i] * vz_[i]);
            const float a = std::sqrt(ax_[i] * ax_[i] + ay_[i] * ay_[i] + az_[i] * az_[i]);
            slowness_[i] = 1 / (v + a * left_[i] + Field::fastest + 1e-6f);
            above_[i] = height(i, 0);
            s_[i] = low_[i] = 0;
            inside_[i] = 0;
        }
        // On the surface the direction of motion matters.
        for (int i = 0; i < n_; ++i) {
            if (above_[i] > flush) continue;
            const V P{x_[i], y_[i], z_[i]}, n = field.normal(P, begun_[i]);
            inside_[i] = dot(V{vx_[i], vy_[i], vz_[i]} - field.velocity(P), n) <= 0;
            const float out = flush - above_[i];
            x_[i] += out * n.x, y_[i] += out * n.y, z_[i] += out * n.z;
            above_[i] = flush;
        }
        for (int steps = 0, going = 1; going && steps < 64; ++steps) {
            going = 0;
#pragma omp simd reduction(| : going)
            for (int i = 0; i < n_; ++i) {
                const bool ends = (inside_[i] != 0) | (s_[i] >= lands_[i]);
                const float s = std::min(lands_[i], s_[i] + std::max(above_[i] * slowness_[i], 0.125f * left_[i]));
                const float d = height(i, s);
                low_[i] = ends ? low_[i] : s_[i];
                s_[i] = ends ? s_[i] : s;
                below_[i] = ends ? below_[i] : d;
                inside_[i] = ends ? inside_[i] : (d <= 0 ? 2 : 0);
                above_[i] = ends | (d <= 0) ? above_[i] : d;
                going |= !ends;
            }
        }
        for (int i = 0; i < n_; ++i) {
            if (inside_[i] != 2) continue;
            float low = low_[i], high = s_[i], d_low = above_[i], d_high = below_[i];
            for (int refined = 0; refined < 2; ++refined) {
                const float middle = low + (high - low) * d_low / (d_low - d_high), d = height(i, middle);
                (d > 0 ? low : high) = middle;
                (d > 0 ? d_low : d_high) = d;
            }
            s_[i] = low + (high - low) * d_low / (d_low - d_high);
        }
    }

    int n_ = 0;
    std::int32_t point_[block], inside_[block];  // 1: since the start, 2: at s
    float x_[block], y_[block], z_[block], vx_[block], vy_[block], vz_[block], ax_[block], ay_[block], az_[block];
    float begun_[block], left_[block];  // s, of the step
    float lands_[block], slowness_[block], above_[block], below_[block], low_[block], s_[block];
};

// Prints the moments of the points' positions as JSON.
template <int columns>
int report(const Points<columns>& points)
{
    double sum[3] = {}, squares[3] = {};
    const double n = static_cast<double>(points.size());
    for (int k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < points.size(); ++i) sum[k] += points[k][i];
    for (int k = 0; k < 3; ++k)
        for (std::size_t i = 0; i < points.size(); ++i) squares[k] += std::pow(points[k][i] - sum[k] / n, 2);
    std::printf("{\"points\": %zu, \"mean\": [%.9g, %.9g, %.9g], \"deviation\": [%.9g, %.9g, %.9g]}\n", points.size(),
                sum[0] / n, sum[1] / n, sum[2] / n, std::sqrt(squares[0] / n), std::sqrt(squares[1] / n),
                std::sqrt(squares[2] / n));
    return 0;
}

// A point as it is born: its columns, and the part of the frame that it lives, s.
template <int columns>
struct Newborn {
    float values[columns];
    float time;
};

// The place of a birth in its frame.
struct Birth {
    int frame;
    std::size_t before;     // births in all earlier frames
    std::size_t i, births;  // this one's index, and the number of births in the frame
};

// Simulates the frames and reports the last one. due(frame): the births up to and including a frame. make(random,
// birth): a Newborn. step(first, last, frame, time_of, dead): moves points. sorted: newborn points that are stepped
// together get their times in ascending order.
template <int columns, bool sorted = false, class Due, class Make, class Step>
int run(Points<columns>& p, int frames, Due due, const Make& make, const Step& step)
{
    Dead dead;
    std::size_t born = 0;
    std::vector<float> own;
    for (int frame = 2; frame <= frames; ++frame) {
        const std::size_t births = due(frame) - born, old = p.append(births);
        own.resize(births);
        dead.begin(old + births + 2 * chunk);
        in_parallel(old, [&](std::size_t begin, std::size_t end) {
            step(
                begin, end, frame, [](std::size_t) { return frame_time; }, dead.of(begin));
        });
        in_parallel(births, [&](std::size_t begin, std::size_t end) {
            Random random(born + begin);
            for (std::size_t i = begin; i < end; ++i) {
                const Newborn<columns> point = make(random, Birth{frame, born, i, births});
                for (int k = 0; k < columns; ++k) p[k][old + i] = point.values[k];
                own[i] = point.time;
            }
            if constexpr (sorted)
                std::sort(own.begin() + static_cast<std::ptrdiff_t>(begin),
                          own.begin() + static_cast<std::ptrdiff_t>(end));
            step(
                old + begin, old + end, frame, [&](std::size_t i) { return own[i - old]; },
                dead.of(old + chunk + begin));
        });
        born += births;
        p.remove(dead.all());
    }
    return report(p);
}

struct Arguments {
    double rate;
    int frames;
};
inline Arguments arguments_of(int count, char** words)
{
    if (count != 3) {
        std::fprintf(stderr, "%s RATE FRAMES\n", words[0]);
        std::exit(2);
    }
    return {std::atof(words[1]), std::atoi(words[2])};
}

}  // namespace by_hand
