// Caches the objects that a function of the frame made in its last call. A constructor called again with the same
// arguments returns the same object, so that nothing is built twice, and caches by identity stay valid.
//
// It holds the objects of two calls: a function that returns a new shape at each frame retains two shapes, not one per
// frame.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "bindings/host/maker.h"

namespace rapid {

class MakerCache {
public:
    // Returns the cached object for equal arguments, or the object that make() returns.
    template <class F>
    ObjectPtr get(const Maker& maker, std::shared_ptr<const Table> arguments, const F& make)
    {
        ObjectPtr object = find(maker, *arguments);
        if (!object) object = make();
        current_.push_back({&maker, std::move(arguments), object});
        return object;
    }

    // Forgets all objects that the last call did not use.
    void begin_call();

    // A call of the function. While it lives, `active` points to its cache.
    class Call {
    public:
        Call(MakerCache& cache, MakerCache*& active) : active_(active), before_(std::exchange(active, &cache))
        {
            cache.begin_call();
        }
        ~Call() { active_ = before_; }
        Call(const Call&) = delete;
        Call& operator=(const Call&) = delete;

    private:
        MakerCache*& active_;
        MakerCache* before_;
    };

private:
    struct Entry {
        const Maker* maker;
        std::shared_ptr<const Table> arguments;
        ObjectPtr object;
    };
    ObjectPtr find(const Maker& maker, const Table& arguments) const;

    std::vector<Entry> last_, current_;  // objects of the previous call and of this one
};

// Returns true if two values are indistinguishable: numbers bitwise, objects by identity. Functions are never
// identical.
bool identical(const Value& a, const Value& b);

}  // namespace rapid
