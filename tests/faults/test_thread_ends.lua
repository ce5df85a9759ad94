-- Memory for the destructor of a variable of a thread is taken by glibc, which ends the process where there is none: no
-- library of ours registers one (runtime/of_thread.h).
local command = require "testing.command"
local library = require "tests.faults.library"

describe("a library of Rapid", function()
  it("has no variables of threads with destructors that glibc would know", function()
    local folder = library:match "^(.*)/"
    local names = command.shell("ls librapid*.so ../bin/rapid | grep -v librapid_fault", { cwd = folder })
    assert.match("librapid.so\n.*librapid_deferred.so\n", names.stdout .. names.stdout)
    for name in names.stdout:gmatch "[^\n]+" do
      local undefined = command.shell("nm -D --undefined-only " .. command.quoted(name), { cwd = folder })
      assert.equal(0, undefined.status, undefined.stderr)
      assert.truthy(undefined.stdout:find "malloc" or undefined.stdout:find "_Znwm", name)
      assert.is_nil(undefined.stdout:find "__cxa_thread_atexit", name)
    end
  end)
end)
