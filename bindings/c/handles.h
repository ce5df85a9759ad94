// Handles of the C interface: numbers in the form of pointers, so that a closed, mistyped or invented one is
// distinguished from an open one. The tables of open handles are the interface's only state.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

namespace rapid {

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

}  // namespace rapid
