-- Scenes in foreign folders, and names that would lead out of them.
local command = require "testing.command"

local function run(folder, text, arguments)
  folder:write("scene.lua", 'local rapid = require "rapid"\n' .. text)
  return command.rapid("run scene.lua -f 1 --quiet " .. (arguments or ""), { cwd = folder.path })
end

local point = "rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } } " ..
  ":points('k', function(p) p.v = p.v end) :solve {}"

describe("a library of Lua", function()
  it("in the current folder, next to a scene, does not replace Rapid's", function()
    local folder = command.folder()
    command.shell("mkdir jit table", { cwd = folder.path })
    for _, name in ipairs { "jit/vmdef", "jit/util", "jit/bc", "vmdef", "ffi", "bit", "table/new", "table/clear",
      "rapid", "describe", "vec3", "dkjson" } do
      folder:write(name .. ".lua", "io.open('seen', 'w'):close() return {}")
    end
    for _, line in ipairs { 'run scene.lua -f 1 --quiet', "check scene.lua", "explain scene.lua", "nodes" } do
      folder:write("scene.lua", 'local rapid = require "rapid" return ' .. point)
      local result = command.rapid(line, { cwd = folder.path })
      assert.equal("", result.stderr)
      assert.equal(0, result.status)
    end
    -- Not even if the environment requests it.
    command.rapid("run scene.lua -f 1 --quiet", { cwd = folder.path,
      environment = { LUA_PATH = "./?.lua;;", LUA_CPATH = "./?.so;;", LUA_INIT = "@rapid.lua" } })
    assert.is_nil(folder:read "seen")
  end)
end)

describe("a program", function()
  it("in the current folder, next to a scene, is not run, whatever PATH contains", function()
    local folder = command.folder()
    folder:write("scene.lua", 'local rapid = require "rapid" return ' .. point)
    for _, name in ipairs { "ffmpeg", "dot", "sbatch", "squeue", "scancel" } do
      folder:write(name, "#!/bin/sh\n: >seen\necho 17\n")
      command.shell("chmod +x " .. name, { cwd = folder.path })
    end
    for _, line in ipairs { "run scene.lua -f 1-2 --quiet -o film.mp4", "graph scene.lua -o graph.svg",
      "run scene.lua -f 1-2 -o a.####.csv --farm slurm --parts 2" } do
      command.rapid(line, { cwd = folder.path, environment = { PATH = ":.:" .. folder.path:gsub("^/", "") } })
      assert.is_nil(folder:read "seen", line)
    end
  end)
end)

describe("the name of an output", function()
  it("does not lead out of the folder that it is written to", function()
    for _, name in ipairs { "../x", "/tmp/x", "a/../../x", "..", ".", ".hidden", "", "a\\0b", "a\\nb", "\\27[2J",
      ("x"):rep(201) } do
      local folder = command.folder()
      local result = run(folder, ("return { ['%s'] = %s }"):format(name, point), "-o out/{output}.####.csv")
      assert.equal(2, result.status, name)
      assert.match("^scene.lua: the graph returns an output \".*\"; the name becomes part of file names, so it " ..
        "must have 1 to 200 bytes, no / and no control characters, and must not begin with a dot\n$", result.stderr)
      assert.same({ "scene.lua" }, folder:list())
    end
    local folder = command.folder()
    assert.equal("", run(folder, ("return { ['grains & dust.2'] = %s }"):format(point), "-o {output}.####.csv").stderr)
    assert.truthy(folder:read "grains & dust.2.0001.csv")
  end)
end)

describe("a file that a scene writes", function()
  local writers = {
    ["x.0001.csv"] = point .. " :write { file = '%sx.####.csv' }",
    ["x.0001.vdb"] = point .. " :rasterize { file = '%sx.####.vdb' }",
    ["x.vdb"] = point .. ", rapid.levelset.sphere { voxel = 0.2 } :write '%sx.vdb'",
  }
  -- Creates a folder with a scene that writes to the folder `place`.
  local function new_folder(text, place)
    local folder = command.folder()
    command.shell("mkdir work beside", { cwd = folder.path })
    folder:write("work/scene.lua", 'local rapid = require "rapid"\nlocal chain = ' ..
      text:format(place:gsub("PATH", folder.path)) .. "\nreturn chain")
    return folder
  end
  local function run_in(folder, arguments)
    return command.rapid("run scene.lua -f 1 --quiet " .. arguments, { cwd = folder:file "work" })
  end

  it("is where the scene says", function()
    for file, text in pairs(writers) do
      for _, place in ipairs { "../beside/", "PATH/beside/", "" } do
        local folder = new_folder(text, place)
        local result = run_in(folder, "")
        assert.equal("", result.stderr)
        assert.equal(0, result.status)
        assert.truthy(folder:read((place == "" and "work/" or "beside/") .. file), place .. file)
      end
    end
  end)

  it("is nowhere but in the outputs' folders with --untrusted", function()
    for file, text in pairs(writers) do
      for _, place in ipairs { "../beside/", "PATH/beside/", "" } do
        local folder = new_folder(text, place)
        local result = run_in(folder, "--untrusted -o out/{output}.####.csv")
        assert.not_equal(0, result.status, place .. file)
        assert.match("x%.[%w.]+\"?: can't be written", result.stderr)
        assert.is_nil(folder:read((place == "" and "work/" or "beside/") .. file), place .. file)
        assert.equal(0, run_in(new_folder(text, "out/"), "--untrusted -o out/{output}.####.csv").status)
      end
    end
  end)
end)

describe("a name with a byte 0", function()
  it("is not cut there: it names no file", function()
    local folder = command.folder()
    folder:write("points", "Px,Py,Pz\n1,2,3\n")
    local read = run(folder, "return rapid.create { points = rapid.points.read 'points\\0.csv' } :solve {}")
    assert.equal(2, read.status)
    assert.match("can't be read: its name contains a zero byte", read.stderr)
    local written = run(folder, "return " .. point .. " :write { file = 'new\\0.####.csv' }")
    assert.equal(1, written.status)
    assert.match("can't be written: its name contains a zero byte", written.stderr)
    local level_set = run(folder, "rapid.levelset.sphere { voxel = 0.2 } :write 'new\\0.vdb' return " .. point)
    assert.not_equal(0, level_set.status)
    assert.same({ "points", "scene.lua" }, folder:list())
  end)
end)
