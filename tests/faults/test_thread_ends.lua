-- glibc allocates memory for the destructor of a thread-local variable, and ends the process if it cannot. Our
-- libraries therefore register none (runtime/base/per_thread.h).
local command = require "testing.command"
local library = require "tests.faults.library"

describe("a library of Rapid", function()
  it("has no variables of threads with destructors that glibc would know", function()
    local folder = library:match "^(.*)/"
    local all = "ls librapid*.so ../bin/rapid ../libexec/rapid/* | grep -v librapid_fault"
    local names = command.shell(all, { cwd = folder })
    assert.match("librapid.so\n.*librapid_deferred.so\n", names.stdout .. names.stdout)
    for name in names.stdout:gmatch "[^\n]+" do
      local undefined = command.shell("nm -D --undefined-only " .. command.quoted(name), { cwd = folder })
      assert.equal(0, undefined.status, undefined.stderr)
      assert.truthy(undefined.stdout:find "malloc" or undefined.stdout:find "_Znwm", name)
      assert.is_nil(undefined.stdout:find "__cxa_thread_atexit", name)
    end
  end)

  it("has no variables of threads at all, where it is loaded later", function()
    -- glibc allocates the memory for these when a thread first uses them.
    local folder = command.quoted(library:match "^(.*)/")
    local segments = command.shell("cd " .. folder .. " && readelf -lW librapid_deferred.so")
    assert.equal(0, segments.status, segments.stderr)
    assert.truthy(segments.stdout:find(" LOAD ", 1, true))
    assert.is_nil(segments.stdout:find(" TLS ", 1, true))
  end)
end)
