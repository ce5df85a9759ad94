-- rapid info and rapid diff: the contents of point files, and their differences.
local command = require "testing.command"
local json = require "dkjson"

local folder = command.folder()
local function csv(name, rows)
  folder:write(name, "id,Px,Py,Pz,vx,vy,vz,heat\n" .. table.concat(rows, "\n") .. "\n")
end
csv("a.csv", { "0,0,0,0,0,0,0,1", "1,3,4,0,0,1,0,2", "2,0,0,12,0,0,0,3" })
csv("moved.csv", { "0,0,0,0,0,0,0,1", "1,3,4.5,0,0,1,0,2", "2,0,0,12,0,0,0,3" })
csv("fewer.csv", { "1,3,4,0,0,1,0,2", "0,0,0,0,0,0,0,1" })
-- The bounds' diagonal is 13 m: P may differ by 13e-6 m.
csv("near.csv", { "0,0,0,0,0,0,0,1", "1,3,4.00001,0,0,1,0,2", "2,0,0,12,0,0,0,3" })
for frame = 1, 3 do
  csv(("one.%04d.csv"):format(frame), { ("0,%d,0,0,0,0,0,1"):format(frame) })
  csv(("two.%04d.csv"):format(frame), { ("0,%d,0,0,0,0,0,1"):format(frame == 2 and 7 or frame) })
end
csv("three.0001.csv", { "0,1,0,0,0,0,0,1" })
csv("three.0003.csv", { "0,3,0,0,0,0,0,1" })

local function rapid(arguments)
  return command.rapid(arguments, { cwd = folder.path })
end

describe("rapid info", function()
  it("prints points, attributes with their types, and bounds", function()
    local result = rapid "info a.csv"
    assert.equal(0, result.status, result.stderr)
    assert.truthy(result.stdout:find("points +3\n"), result.stdout)
    assert.truthy(result.stdout:find("bounds +0 0 0  to  3 4 12\n"), result.stdout)
    assert.truthy(result.stdout:find("\n  heat +float +1 +to +3\n"), result.stdout)
    assert.truthy(result.stdout:find("\n  P +vec3 "), result.stdout)
  end)

  it("prints the same as JSON", function()
    local info = json.decode(rapid("info --json a.csv").stdout)
    assert.equal("a.csv", info.file)
    assert.equal(3, info.points)
    assert.same({ 3, 4, 12 }, info.bounds.max)
  end)

  it("describes each file of a sequence, in order", function()
    local infos = json.decode(rapid("info one.####.csv --json").stdout)
    assert.equal(3, #infos)
    for frame, info in ipairs(infos) do
      assert.equal(frame, info.frame)
      assert.equal(frame, info.bounds.max[1])
    end
    assert.truthy(rapid("info one.####.csv").stdout:find("one.0002.csv\n", 1, true))
  end)

  it("takes a character literally after a backslash", function()
    csv("take#2.csv", { "0,0,0,0,0,0,0,1" })
    local result = rapid [[info 'take\#2.csv']]
    assert.equal(0, result.status, result.stderr)
    assert.truthy(result.stdout:find("points +1\n"), result.stdout)
  end)

  it("does not wait for the writer of a pipe", function()
    os.execute("mkfifo " .. folder:file "pipe.csv")
    local result = rapid "info pipe.csv"
    os.remove(folder:file "pipe.csv")
    assert.equal(2, result.status)
    assert.equal("pipe.csv: can't be read: it is not a regular file\n", result.stderr)
  end)

  it("prints a name that holds commands for the terminal without them", function()
    folder:write("name.csv", "Px,Py,Pz,a\27]0;b\7\n0,0,0,1\n")
    local result = rapid "info name.csv"
    assert.equal(0, result.status, result.stderr)
    assert.truthy(result.stdout:find("  a\\x1b]0;b\\x07 ", 1, true), result.stdout)
    assert.equal("a\27]0;b\7", json.decode(rapid("info name.csv --json").stdout).attributes[4].name)
  end)

  it("says what it can't read, with 2", function()
    for name, message in pairs {
      ["no.csv"] = "no.csv: no such file\n",
      ["no.####.csv"] = "no.####.csv: no frame of this sequence exists; the first would be no.0001.csv\n",
      ["."] = ".: is a folder; name a file, or a sequence such as cache.####.vdb\n",
    } do
      local result = rapid("info " .. name)
      assert.equal(2, result.status)
      assert.equal(message, result.stderr)
    end
    folder:write("broken.vdb", "this is no grid")
    local broken = rapid "info broken.vdb"
    assert.equal(2, broken.status)
    assert.truthy(broken.stderr:find("^broken.vdb: "), broken.stderr)
  end)
end)

describe("rapid diff", function()
  it("is done with 0 where two files are the same", function()
    assert.equal(0, rapid("diff a.csv a.csv").status)
    assert.equal(0, rapid("diff a.csv near.csv").status)
  end)

  it("refuses points with the same id, and ends with 2", function()
    csv("twice.csv", { "0,0,0,0,0,0,0,1", "1,3,4,0,0,1,0,2", "1,0,0,12,0,0,0,3" })
    for _, files in ipairs { "a.csv twice.csv", "twice.csv a.csv", "twice.csv twice.csv" } do
      local result = rapid("diff " .. files)
      assert.equal(2, result.status)
      assert.truthy(result.stderr:find("^two points of [AB] have the id 1; points are compared by id, so ids must " ..
        "be unique\n$"), result.stderr)
    end
  end)

  it("ends with 1 where they differ, and says how much", function()
    local result = rapid "diff a.csv moved.csv --json"
    assert.equal(1, result.status)
    local diff = json.decode(result.stdout)
    assert.is_false(diff.same)
    for _, attribute in ipairs(diff.attributes) do
      assert.equal(attribute.name ~= "P", attribute.same)
      if attribute.name == "P" then
        assert.near(0.5, attribute.max, 1e-6)
        assert.near(math.sqrt(0.25 / 3), attribute.rms, 1e-6)
        assert.equal(1, attribute.worst_id)
      end
    end
    assert.equal(1, rapid("diff a.csv moved.csv").status)
  end)

  it("matches points by id, and names those that are missing", function()
    local result = rapid "diff a.csv fewer.csv --json"
    assert.equal(1, result.status)
    local diff = json.decode(result.stdout)
    assert.same({ 2 }, diff.only_a)
    assert.equal(2, diff.compared)
    for _, attribute in ipairs(diff.attributes) do assert.equal(0, attribute.max) end
  end)

  it("takes a tolerance", function()
    assert.equal(1, rapid("diff a.csv near.csv --tolerance 0").status)
    assert.equal(0, rapid("diff --tolerance 0.1 a.csv moved.csv").status)
    assert.equal(2, rapid("diff a.csv moved.csv --tolerance -1").status)
  end)

  it("compares sequences frame by frame", function()
    assert.equal(0, rapid("diff one.####.csv one.####.csv").status)
    local result = rapid "diff one.####.csv two.####.csv"
    assert.equal(1, result.status)
    assert.truthy(result.stdout:find("frame 2\n", 1, true))
    assert.falsy(result.stdout:find("frame 3\n", 1, true))
    assert.truthy(result.stdout:find("2 of 3 common frames are the same\n", 1, true))
  end)

  it("counts a frame that one sequence alone has as a difference", function()
    local result = rapid "diff one.####.csv three.####.csv"
    assert.equal(1, result.status)
    assert.truthy(result.stdout:find("only in one.####.csv: frames 2\n", 1, true))
    local diff = json.decode(rapid("diff one.####.csv three.####.csv --json").stdout)
    assert.same({ 2 }, diff.only_a)
    assert.equal(2, #diff.frames)
  end)

  it("ends with 2 where one can't be read, or they are not of a kind", function()
    assert.equal(2, rapid("diff a.csv no.csv").status)
    assert.equal(2, rapid("diff a.csv one.####.csv").status)
    assert.equal(2, rapid("diff a.csv").status)
  end)
end)
