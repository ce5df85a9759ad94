// Special environments for tests: a small disk, and a user to whom permissions apply.
#pragma once

#include <sys/mount.h>
#include <unistd.h>

#include <cstdlib>

#include "tests/files/temporary_folder.h"

namespace rapid::test {

// A memory file system of one megabyte, if the test is allowed to mount one.
class SmallDisk {
public:
    SmallDisk() { mounted_ = ::mount("tmpfs", folder_.path().c_str(), "tmpfs", 0, "size=1m") == 0; }
    ~SmallDisk()
    {
        if (mounted_) ::umount(folder_.path().c_str());
    }
    bool mounted() const { return mounted_; }
    const TemporaryFolder& folder() const { return folder_; }

private:
    TemporaryFolder folder_;
    bool mounted_;
};

// Runs as another user, to whom permissions apply, during its lifetime.
class Unprivileged {
public:
    Unprivileged() { changed_ = ::geteuid() == 0 && ::seteuid(65534) == 0; }
    ~Unprivileged()
    {
        if (changed_ && ::seteuid(0) != 0) std::abort();
    }

private:
    bool changed_;
};

}  // namespace rapid::test
