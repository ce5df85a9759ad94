// Shared code of the functions of rapid.h.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <cstdint>
#include <cstring>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "bindings/scene/scene_error.h"
#include "include/rapid/rapid.h"
#include "include/rapid/scene.h"
#include "include/rapid/shapes.h"

namespace rapid {

// Handles of the C interface: numbers in the form of pointers, so that a closed, mistyped or invented one is
// distinguished from an open one. The tables of open handles are the interface's only state.

// The open objects of one type. Callable from any thread.
//
// A handle is, from its lowest bit: 1 (no pointer is odd), the type (3 bits), the slot in the table (28), the number
// of objects that have used the slot (32), so that a reused slot has another handle.
template <class T, unsigned type>
class Handles {
public:
    // Returns null if the handle does not belong to an open object.
    static std::shared_ptr<T> get(const void* handle)
    {
        Table& all = table();
        const std::lock_guard lock(all.mutex);
        Entry* entry = all.find(handle);
        return entry ? entry->object : nullptr;
    }

    static void* add(std::shared_ptr<T> object)
    {
        Table& all = table();
        const std::lock_guard lock(all.mutex);
        if (all.free_slots.empty()) {
            all.free_slots.reserve(all.entries.size() + 1);  // so that remove() does not allocate
            all.entries.emplace_back();
            all.free_slots.push_back(static_cast<std::uint32_t>(all.entries.size() - 1));
        }
        const std::uint32_t slot = all.free_slots.back();
        all.free_slots.pop_back();
        Entry& entry = all.entries[slot];
        entry.object = std::move(object);
        ++entry.use;
        const std::uint64_t bits = std::uint64_t{entry.use} << 32 | std::uint64_t{slot} << 4 | type << 1 | 1;
        return reinterpret_cast<void*>(static_cast<std::uintptr_t>(bits));
    }

    // Closes the handle and returns its object; null if it was not open.
    static std::shared_ptr<T> remove(const void* handle)
    {
        Table& all = table();
        const std::lock_guard lock(all.mutex);
        Entry* entry = all.find(handle);
        if (!entry) return nullptr;
        all.free_slots.push_back(static_cast<std::uint32_t>(entry - all.entries.data()));
        return std::exchange(entry->object, nullptr);
    }

private:
    static_assert(sizeof(void*) == 8);

    struct Entry {
        std::shared_ptr<T> object;
        std::uint32_t use = 0;
    };
    struct Table {
        std::mutex mutex;
        std::vector<Entry> entries;
        std::vector<std::uint32_t> free_slots;

        Entry* find(const void* handle)
        {
            const auto bits = static_cast<std::uint64_t>(reinterpret_cast<std::uintptr_t>(handle));
            const std::size_t slot = (bits & 0xffffffff) >> 4;
            if ((bits & 15) != (type << 1 | 1) || slot >= entries.size()) return nullptr;
            Entry& entry = entries[slot];
            return entry.object && entry.use == bits >> 32 ? &entry : nullptr;
        }
    };
    static Table& table()
    {
        static auto* one = new Table;  // never destroyed: programs close handles while they end
        return *one;
    }
};

// An open scene, with the texts that it has returned.
struct OpenScene {
    Scene scene;
    std::atomic<bool> is_busy = false;
    std::string node_types, warnings, explanation, graph, lives;
};
struct OpenFrame {
    SceneFrame frame;
    std::mutex mutex;                            // guards the texts
    std::map<std::string, std::string> strings;  // by subject
    std::map<std::string, SceneValue> details;
};
struct OpenShapes {
    SceneShapes shapes;
    std::vector<ShapeMesh> meshes;
    std::vector<ShapePlane> planes;
    std::string warnings;
};
struct OpenError {
    SceneError error;
    std::string text;
};

// Calls the program's functions after the last callback of a set of offers is destroyed.
class OffersEnd {
public:
    OffersEnd() = default;
    OffersEnd(const OffersEnd&) = delete;
    OffersEnd& operator=(const OffersEnd&) = delete;
    ~OffersEnd()
    {
        for (const auto& [release, user] : calls) release(user);
    }

    std::vector<std::pair<void (*)(void*), void*>> calls;
};

struct OpenOffers {
    std::mutex mutex;
    // Shared with every callback that is offered.
    std::shared_ptr<OffersEnd> end = std::make_shared<OffersEnd>();
    std::vector<std::pair<std::string, HostObject>> objects;
    std::vector<HostNode> nodes;
    bool guard = false;
};

using Scenes = Handles<OpenScene, 1>;
using Frames = Handles<OpenFrame, 2>;
using Snapshots = Handles<SceneSnapshot, 3>;
using Errors = Handles<OpenError, 4>;
using AllOffers = Handles<OpenOffers, 5>;
using AllShapes = Handles<OpenShapes, 6>;

// Stores the error in *to, and returns its status.
int report_error(rapid_error** to, SceneError error) noexcept;

// Runs f, the body of a function.
template <class F>
int guarded(rapid_error** error, const F& f) noexcept
{
    if (error) *error = nullptr;
    try {
        f();
        return RAPID_OK;
    } catch (...) {
        try {
            return report_error(error, caught_error(SceneError::Unexpected));
        } catch (...) {
            return RAPID_OUT_OF_MEMORY;  // not even the text fits into memory
        }
    }
}

// Runs a getter: f(), or an empty value if the handle is not open or the scene is in another call.
template <class F>
auto value_or_default(const F& f) noexcept -> decltype(f())
{
    try {
        return f();
    } catch (...) {
        return {};
    }
}

// Returns the open object of a handle. Throws Error if there is none.
template <class Table>
auto open(const void* handle, const char* what)
{
    auto object = Table::get(handle);
    if (!object)
        refuse(handle ? fmt::format("the {} handle is not open: it was closed, or it is the handle of something else",
                                    what)
                      : fmt::format("the {} handle is NULL", what));
    return object;
}
inline auto open_scene(rapid_scene* handle) { return open<Scenes>(handle, "scene"); }
// Holds the scene for a call. Throws Error if another call is running, whose state would be half done.
class SceneCall {
public:
    explicit SceneCall(rapid_scene* handle) : open_(open_scene(handle))
    {
        if (open_->is_busy.exchange(true)) throw SceneException(busy());
    }
    ~SceneCall() { open_->is_busy = false; }
    SceneCall(const SceneCall&) = delete;
    SceneCall& operator=(const SceneCall&) = delete;

    OpenScene* operator->() const { return open_.get(); }
    Scene& scene() const { return open_->scene; }

private:
    const std::shared_ptr<OpenScene> open_;  // if closed meanwhile, it lives to the end of the call
};
inline auto open_offers(rapid_offers* handle) { return open<AllOffers>(handle, "offers"); }
inline auto open_frame(rapid_frame* handle) { return open<Frames>(handle, "frame"); }
inline auto open_shapes(rapid_shapes* handle) { return open<AllShapes>(handle, "shapes"); }
inline auto open_snapshot(rapid_snapshot* handle) { return open<Snapshots>(handle, "snapshot"); }

template <class T>
T& not_null(T* pointer, const char* name)
{
    if (!pointer) refuse(fmt::format("{} is NULL", name));
    return *pointer;
}

// Reads a caller's struct, whose size says which members it has; the rest is as in `known`.
template <class T>
T known_part(const T* given, const char* name, T known = {})
{
    const std::size_t size = not_null(given, name).size;
    if (size < sizeof(std::size_t) || size > (std::size_t{1} << 16))
        refuse(fmt::format("{0}->size = {1}; it must be sizeof(*{0})", name, size));
    std::memcpy(static_cast<void*>(&known), given, std::min(size, sizeof known));
    const char* const bytes = reinterpret_cast<const char*>(given);
    if (size > sizeof known && std::any_of(bytes + sizeof known, bytes + size, [](char byte) { return byte != 0; }))
        refuse(
            fmt::format("{} requests a feature that this version of Rapid does not know; build the program for this "
                        "version, or install a newer one",
                        name));
    return known;
}

// Fills a caller's struct as far as its size allows. least: the size of the struct's first version.
template <class T>
void store(T* to, T from, const char* name)
{
    const std::size_t size = not_null(to, name).size;
    if (size < sizeof(std::size_t) || size > (std::size_t{1} << 16))
        refuse(fmt::format("{0}->size = {1}; it must be sizeof(*{0})", name, size));
    from.size = size;
    std::memcpy(static_cast<void*>(to), &from, std::min(size, sizeof(T)));
    if (size > sizeof(T)) std::memset(reinterpret_cast<char*>(to) + sizeof(T), 0, size - sizeof(T));
}

template <class T>
const T& at_index(const std::vector<T>& all, std::size_t index, const char* whose, const char* what)
{
    if (index >= all.size()) refuse(fmt::format("index = {}; {} {} {}", index, whose, all.size(), what));
    return all[index];
}

// Returns one line each.
inline std::string joined(const std::vector<std::string>& lines) { return fmt::format("{}", fmt::join(lines, "\n")); }

SceneOptions options_of(const rapid_options* given);
// Returns the camera of a program's pointer, empty for null.
PictureCamera camera_of(const rapid_camera* given);

// text: lives as long as the handle.
rapid_value value_in_c(const SceneValue& value);
SceneValue value_of(const rapid_value& value, const std::string& name);

rapid_frame* new_frame(SceneFrame frame);

}  // namespace rapid
