-- --untrusted: the operating system's sandbox around a run and around other commands.
local command = require "testing.command"
local json = require "dkjson"

local triangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"

local function graph(body)
  return "local rapid = require 'rapid'\nlocal two = rapid.points.from { P = {{0, 1, 0}, {1, 1, 0}} }\n" .. body
end

-- Creates a folder with a graph, and another folder that the graph must not access.
local function new_folder(body)
  local root = command.folder()
  command.shell("mkdir inside outside out", { cwd = root.path })
  root:write("outside/mesh.obj", triangle)
  root:write("inside/mesh.obj", triangle)
  root:write("inside/scene.lua", graph(body))
  function root:run(arguments)
    return command.rapid("run inside/scene.lua -f 1-3 --quiet --untrusted " .. (arguments or ""), { cwd = self.path })
  end
  return root
end

local plain = "return rapid.create { points = two } :gravity {} :solve {}"

describe("rapid run --untrusted", function()
  it("is bit-identical to a run without it", function()
    local folder = new_folder(plain)
    assert.equal(0, folder:run("-o out/a.####.csv").status)
    local open = command.rapid("run inside/scene.lua -f 1-3 --quiet -o out/b.####.csv", { cwd = folder.path })
    assert.equal(0, open.status)
    assert.truthy(folder:read "out/a.0003.csv")
    assert.equal(folder:read "out/b.0003.csv", folder:read "out/a.0003.csv")
  end)

  it("makes the outputs' folders, and writes figures", function()
    local folder = new_folder(plain)
    local result = folder:run("-o new/deep/a.####.vdb --stats figures/run.json")
    assert.equal("", result.stderr)
    assert.truthy(folder:read "new/deep/a.0001.vdb")
  end)

  it("reads the graph's folder, and no other", function()
    local read = "local m = rapid.mesh.read '%s' return rapid.create {} :emit { source = m, count = 5 } :solve {}"
    assert.equal(0, new_folder(read:format "mesh.obj"):run().status)
    local folder = new_folder(read:format "../outside/mesh.obj")
    local refused = folder:run()
    assert.equal(2, refused.status)
    assert.match("inside/scene.lua:3: rapid.mesh.read: .*outside/mesh.obj", refused.stderr)
    assert.equal(0, folder:run("--allow-read outside").status)
    assert.equal(0, folder:run("--allow-read outside/mesh.obj").status)
  end)

  it("follows no link out of the folder", function()
    local folder = new_folder("return rapid.create { points = rapid.points.read 'link.csv' } :solve {}")
    folder:write("outside/secret.csv", "Px,Py,Pz\n1,2,3\n")
    command.shell("ln -s ../outside/secret.csv inside/link.csv", { cwd = folder.path })
    assert.equal(2, folder:run().status)
  end)

  it("reads neither the environment nor the addresses of its own process", function()
    local folder = new_folder [[
print(pcall(require, "link"))
print(pcall(rapid.points.read, "link.csv"))
return rapid.create { points = two } :solve {}]]
    for _, file in ipairs { "environ", "maps", "cmdline", "auxv", "mem", "task/self/environ" } do
      command.shell("ln -sfn /proc/self/" .. file .. " inside/link.lua; ln -sfn /proc/self/" .. file ..
        " inside/link.csv", { cwd = folder.path })
      local result = command.rapid("run inside/scene.lua -f 1 --untrusted", { cwd = folder.path })
      assert.equal(0, result.status, result.stderr)
      assert.match('false\tno module "link"', result.stdout)
      assert.match("link.csv: can't be read: ", result.stdout)
    end
  end)

  it("knows what memory it takes", function()
    local folder = new_folder(plain)
    assert.equal(0, folder:run("-o out/a.####.csv --stats out/stats.json").status)
    assert.truthy(json.decode(folder:read "out/stats.json").peak_bytes > 1e6)
  end)

  it("writes to the outputs' folders, and nowhere else", function()
    local write = "return rapid.create { points = two } :solve {} :write { file = '%s' }"
    local folder = new_folder(write:format "outside/a.####.csv")
    local refused = folder:run("-o out/b.####.csv")
    assert.equal(1, refused.status)
    assert.match("outside/a.0001.csv: .*can't be written: Permission denied", refused.stderr)
    assert.is_nil(folder:read "outside/a.0001.csv")
    folder = new_folder(write:format "out/a.####.csv")
    assert.equal(0, folder:run("-o out/b.####.csv").status)
    assert.truthy(folder:read "out/a.0003.csv")
    folder = new_folder(write:format "inside/scene.lua")
    assert.not_equal(0, folder:run("-o out/b.####.csv").status)
    assert.match("two = rapid.points", folder:read "inside/scene.lua")
  end)

  it("has the system's filter around every thread, and no privileges to gain, or of root's", function()
    local folder = new_folder("local n = 0 for i = 1, 3e8 do n = n + i % 7 end " .. plain)
    local seen = command.shell([[
"$RAPID" run inside/scene.lua --untrusted --quiet -f 1 & pid=$!
for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
  grep -qs 'Seccomp:.2' /proc/$pid/status && break
  sleep 0.05
done
grep -h -E '^(Seccomp|NoNewPrivs|Cap(Inh|Prm|Eff|Amb)):' /proc/$pid/task/*/status
kill -9 $pid]], { cwd = folder.path }).stdout
    -- CAP_DAC_OVERRIDE, CAP_DAC_READ_SEARCH, CAP_FOWNER: files of other users.
    local sets = 0
    for set in seen:gmatch "Cap%w+:%s*(%x+)" do
      assert.equal(0, bit.band(tonumber(set:sub(-8), 16), bit.bnot(0xe)), set)
      assert.match("^0+$", set:sub(1, -9))
      sets = sets + 1
    end
    local threads = 0
    for name, value in seen:gmatch "([SN]%w+):%s*(%d+)" do
      assert.equal(name == "Seccomp" and "2" or "1", value, name)
      threads = threads + (name == "Seccomp" and 1 or 0)
    end
    assert.truthy(threads >= 2)
    assert.equal(4 * threads, sets)
  end)

  it("has neither the descriptors, nor standard input, nor the environment that it inherits", function()
    local folder = new_folder("local n = 0 for i = 1, 3e8 do n = n + i % 7 end " .. plain)
    local seen = command.shell([[
echo secret >outside/secret
export SECRET=hush RAPID_KEPT=known
"$RAPID" run inside/scene.lua --untrusted --quiet -f 1 7<outside/secret <outside/secret & pid=$!
for i in 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19 20; do
  grep -qs 'Seccomp:.2' /proc/$pid/status && break
  sleep 0.05
done
grep -h Seccomp: /proc/$pid/status
for fd in /proc/$pid/fd/*; do readlink $fd; done
tr '\0' '\n' </proc/$pid/environ
kill -9 $pid]], { cwd = folder.path }).stdout
    assert.match("Seccomp:%s*2", seen)
    assert.match("/dev/null", seen)
    assert.falsy(seen:find "secret", seen)
    assert.falsy(seen:find "hush", seen)
    assert.match("\nRAPID_KEPT=known\n", seen)
  end)

  it("reads modules on RAPID_PATH", function()
    local folder = new_folder("require 'depth' " .. plain)
    folder:write("outside/depth.lua", "return 5")
    assert.equal(2, folder:run().status)
    local found = command.rapid("run inside/scene.lua -f 1-3 --quiet --untrusted",
      { cwd = folder.path, environment = { RAPID_PATH = "/nowhere:" .. folder:file "outside" } })
    assert.equal("", found.stderr)
    assert.equal(0, found.status)
  end)

  -- OpenVDB reads in the reader process.
  it("reads .vdb and meshes bit-identical to a run without it", function()
    local folder = new_folder([[
rapid.levelset.sphere { voxel = 0.1 } :write "out/ball.vdb"
return rapid.create { points = two } :solve {}]])
    assert.equal(0, command.rapid("run inside/scene.lua -f 1 --quiet -o inside/two.vdb", { cwd = folder.path }).status)
    command.shell("mv inside/out/ball.vdb inside/ball.vdb || mv out/ball.vdb inside/ball.vdb", { cwd = folder.path })
    folder:write("inside/scene.lua", graph [[
return rapid.create { points = rapid.points.read "two.vdb" } :emit { source = rapid.mesh.read "mesh.obj", count = 9 }
  :gravity {} :collide { shape = rapid.levelset.read "ball.vdb" } :solve {}]])
    local result = folder:run "-o out/a.####.csv"
    assert.equal("", result.stderr)
    command.rapid("run inside/scene.lua -f 1-3 --quiet -o out/b.####.csv", { cwd = folder.path })
    assert.equal(folder:read "out/b.0003.csv", folder:read "out/a.0003.csv")
    assert.match("\n10,", folder:read "out/a.0003.csv")
  end)

  it("also accepts arguments after --", function()
    local folder = new_folder(plain)
    local result = command.rapid("run --untrusted --quiet -f 1-3 -- inside/scene.lua", { cwd = folder.path })
    assert.equal("", result.stderr)
    assert.equal(0, result.status)
  end)

  it("refuses options that the sandbox can't guarantee", function()
    local folder = new_folder(plain)
    local watched = folder:run("--watch")
    assert.equal(2, watched.status)
    assert.match("%-%-watch starts processes, which %-%-untrusted does not allow", watched.stderr)
    local missing = folder:run("--allow-read nowhere")
    assert.equal(2, missing.status)
    assert.match("can't open nowhere", missing.stderr)
    local alone = command.rapid("run inside/scene.lua --allow-read outside", { cwd = folder.path })
    assert.equal(2, alone.status)
    assert.match("%-%-allow%-read needs %-%-untrusted", alone.stderr)
    local feigned = folder:run("--sandboxed")
    assert.equal(2, feigned.status)
    assert.match("not inside Landlock", feigned.stderr)
  end)
end)

describe("--untrusted of other commands", function()
  local read = "rapid.mesh.read '../outside/mesh.obj' " .. plain

  it("keeps a graph that is checked in its folder", function()
    local folder = new_folder(read)
    local function check(arguments)
      return command.rapid("check inside/scene.lua " .. arguments, { cwd = folder.path })
    end
    assert.equal(0, check("").status)
    local refused = check "--untrusted"
    assert.equal(2, refused.status)
    assert.match("inside/scene.lua:3: rapid.mesh.read: .*outside/mesh.obj", refused.stderr)
    assert.equal(0, check("--untrusted --allow-read outside").status)
    assert.equal(check("").stdout, check("--untrusted --allow-read outside").stdout)
    assert.equal(0, check("--untrusted --allow-read outside --races").status)
  end)

  it("keeps graphs that are explained in their folders", function()
    local folder = new_folder(read)
    command.shell("mkdir other", { cwd = folder.path })
    folder:write("other/scene.lua", graph(plain))
    local function explain(arguments)
      return command.rapid("explain inside/scene.lua " .. arguments, { cwd = folder.path })
    end
    assert.equal(0, explain("").status)
    local refused = explain "--untrusted"
    assert.equal(2, refused.status)
    assert.match("inside/scene.lua:3: rapid.mesh.read: .*outside/mesh.obj", refused.stderr)
    assert.equal(explain("").stdout, explain("--untrusted --allow-read outside").stdout)
    local against = explain "--against other/scene.lua"
    assert.equal(0, against.status)
    assert.equal(against.stdout, explain("--against other/scene.lua --untrusted --allow-read outside").stdout)
  end)

  it("keeps graphs that are drawn in their folders, and starts no program for it", function()
    local folder = new_folder(read)
    local function draw(arguments)
      return command.rapid("graph inside/scene.lua " .. arguments, { cwd = folder.path })
    end
    local refused = draw "--untrusted"
    assert.equal(2, refused.status)
    assert.match("inside/scene.lua:3: rapid.mesh.read: .*outside/mesh.obj", refused.stderr)
    assert.equal(draw("").stdout, draw("--untrusted --allow-read outside").stdout)
    assert.equal(0, draw("--untrusted --allow-read outside -o out.dot").status)
    assert.equal(draw("").stdout, folder:read "out.dot")
    for _, name in ipairs { "out.svg", "out.json" } do
      local laid_out = draw("--untrusted --allow-read outside -o " .. name)
      assert.equal(2, laid_out.status)
      assert.match("needs the program dot, which %-%-untrusted does not allow; write .dot instead", laid_out.stderr)
    end
  end)

  it("keeps a graph that is studied in its folder, and writes the study", function()
    local folder = new_folder(plain:gsub("gravity {}", "gravity {} :attract { strength = 1 }"))
    local function study(arguments)
      return command.rapid("study inside/scene.lua --sweep solve.substeps=1,2 --reference 8 -f 1-3 --quiet " ..
        "--repeat 1 -o out " .. arguments, { cwd = folder.path })
    end
    local result = study "--untrusted"
    assert.equal("", result.stderr)
    assert.equal(0, result.status)
    assert.match("%d", folder:read "out/study.json")
    folder:write("inside/scene.lua", graph(read))
    local refused = study "--untrusted"
    assert.not_equal(0, refused.status)
    assert.match("outside/mesh.obj", refused.stdout .. refused.stderr)
    -- Its processes read foreign formats in separate copies.
    folder:write("inside/scene.lua", graph(read:gsub("../outside/mesh", "mesh")
      :gsub("gravity {}", "gravity {} :attract { strength = 1 }")))
    local inside = study "--untrusted"
    assert.equal("", inside.stderr)
    assert.equal(0, inside.status)
  end)

  it("describes and compares files, one or a sequence, as ever", function()
    local folder = new_folder(plain)
    assert.equal(0, folder:run("-o out/a.####.csv -o out/b.####.vdb").status)
    for _, arguments in ipairs {
      "info out/a.0002.csv", "info out/b.####.vdb", "info --json out/b.0001.vdb", "diff out/a.####.csv out/b.####.vdb",
      "diff out/a.0001.csv out/a.0002.csv", "info out/missing.csv", "info out/c.####.csv",
    } do
      local open = command.rapid(arguments, { cwd = folder.path })
      local closed = command.rapid(arguments .. " --untrusted", { cwd = folder.path })
      assert.equal(open.stdout, closed.stdout)
      assert.equal(open.stderr, closed.stderr)
      assert.equal(open.status, closed.status)
    end
    command.shell("ln -s ../outside/mesh.obj out/link.csv", { cwd = folder.path })
    assert.not_equal(0, command.rapid("info --untrusted out/link.csv", { cwd = folder.path }).status)
  end)

  it("runs tests that can neither write nor start anything", function()
    local folder = new_folder(plain)
    folder:write("inside/test_sandboxed.lua", [[
describe("sandboxed", function()
  it("let a scene run", function()
    local result = require("rapid").run("inside/scene.lua", { frames = {1, 3} })
    assert.equal(2, #result[3])
  end)
  it("let nothing be written, read elsewhere, or started", function()
    assert.is_nil(io.open("inside/new", "w"))
    assert.is_nil(io.open("outside/mesh.obj"))
    assert.not_equal(0, os.execute "touch outside/new")
  end)
  it("let no secret be asked for", function() assert.is_nil(os.getenv "SECRET") end)
end)]])
    local result = command.rapid("test --untrusted inside/test_sandboxed.lua",
      { cwd = folder.path, environment = { SECRET = "hush" } })
    assert.equal("3 passed, 0 failed, 0 skipped\n", result.stdout)
    assert.is_nil(folder:read "outside/new")
    assert.not_equal(0, command.rapid("test inside/test_sandboxed.lua", { cwd = folder.path }).status)
  end)

  it("ends with an error if a test makes a call of another architecture", function()
    local folder = new_folder(plain)
    folder:write("inside/test_call.lua", [[
local ffi = require "ffi"
ffi.cdef "long syscall(long number, ...);"
it("calls", function() ffi.C.syscall(0x40000000 + 39) end)
it("is run in another process", function() end)]])
    local result = command.shell('ulimit -t 60; exec timeout 60 "$RAPID" test --untrusted inside/test_call.lua',
      { cwd = folder.path })
    assert.equal(1, result.status, result.stderr)
    assert.match("inside/test_call%.lua: the test ended the process with signal 31 %(Bad system call%)",
      result.stdout .. result.stderr)
    assert.match("1 passed, 1 failed", result.stdout)
  end)
end)
