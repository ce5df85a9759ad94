-- Names of output files: two outputs with one name are refused, because one would be lost, and so are names of inputs.
local command = require "testing.command"

local head = 'local rapid = require "rapid"\n'
local chain = "rapid.create { points = rapid.points.from { P = {{0, 1, 0}} } } :solve {}"
local scene = head .. "return " .. chain .. "\n"
local writes = head .. "return " .. chain .. ' :write { file = "x.####.csv" }\n'
local body = head .. "return rapid.create { points = rapid.points.read 'a.0002.csv' } :solve {}\n"

-- Arguments, the message, and the scene if it is a different one.
local refused = {
  { "--stats scene.lua", "--stats scene.lua: the run reads scene.lua; write to another file" },
  { "--profile ./scene.lua", "--profile ./scene.lua: the run reads scene.lua; write to another file" },
  { "-o a.####.csv", "-o a.####.csv: the run reads a.0002.csv; write to another file", body },
  { "--stats a.json --profile ./a.json", "--profile ./a.json: --stats writes a.json, " },
  { "--events a.csv --stats a.csv", "--events a.csv: --stats writes a.csv, " },
  { "--events x.0002.csv -o x.####.csv", "-o x.####.csv: --events writes x.0002.csv, " },
  { "-o x.####.csv -o ./x.####.csv", "-o ./x.####.csv: -o x.####.csv writes x.0001.csv, " },
  { "-f 1 --events 'x#2.csv' -o 'x\\#2.csv'", "-o x\\#2.csv: --events writes x#2.csv, " },
  { "-o x.#.csv -o x.%04d.csv", "-o x.%04d.csv: -o x.#.csv writes x.0001.csv, " },
  { "-f 9998-10000 -o x.####.csv -o x.##.csv", "-o x.##.csv: -o x.####.csv writes x.9998.csv, " },
  { "-o link/../a/x.####.csv -o a/x.####.csv", "-o a/x.####.csv: -o link/../a/x.####.csv writes x.0001.csv, " },
  { "-o link/x.####.csv -o a/x.####.csv", "-o a/x.####.csv: -o link/x.####.csv writes x.0001.csv, " },
  { "-o x.gif --size 64x64 --stats x.gif", "-o x.gif: --stats writes x.gif, " },
  { "-o '{output}.####.csv' -o main.####.csv", "-o main.####.csv: -o {output}.####.csv writes main.0001.csv, " },
  { "--cache c --stats c/journal", "--stats c/journal: --cache writes journal, " },
  { "-o ./x.####.csv", '-o ./x.####.csv: node "write1" writes x.0001.csv, ', writes },
  { "--events x.0003.csv", 'scene.lua:2: node "write1": file = "x.####.csv": --events writes x.0003.csv, ', writes },
}
-- Names of frames that are not written, of other folders, with other numbers.
local taken = {
  { "-f 3-5 -o a.####.csv", body }, { "-o c/a.####.csv", body }, { "-o a.###.csv", body },
  { "--events x.0004.csv -o x.####.csv" }, { "--events x.00001.csv -o x.####.csv" },
  { "-f 1-10 -o x.#.csv -o 'x.$F1.csv'" },
}

local function run(folder, arguments, text)
  command.shell("mkdir a; ln -s a link", { cwd = folder.path })
  folder:write("a.0002.csv", "Px,Py,Pz\n1,2,3\n")
  folder:write("scene.lua", text)
  local result = command.rapid("run scene.lua --quiet " .. (arguments:find "^%-f" and "" or "-f 1-3 ") .. arguments,
    { cwd = folder.path })
  assert.equal(text, folder:read "scene.lua")
  assert.equal("Px,Py,Pz\n1,2,3\n", folder:read "a.0002.csv")
  return result
end

describe("a name that a run writes", function()
  it("is one file's, and none that it reads", function()
    for _, case in ipairs(refused) do
      local result = run(command.folder(), case[1], case[3] or scene)
      local message = case[2]:gsub(", $", " too; give each a different name")
      assert.equal(message .. "\n", result.stderr)
      assert.equal(2, result.status)
    end
    for _, case in ipairs(taken) do
      local result = run(command.folder(), case[1], case[2] or scene)
      assert.equal("", result.stderr)
      assert.equal(0, result.status)
    end
  end)

  it("is that of a .vdb file where a script writes it", function()
    local folder = command.folder()
    for _, write in ipairs { 'rapid.levelset.sphere { voxel = 0.2 } :write "scene.lua"',
      'rapid.grid.from { at = function(P) return P end } :write "scene.lua"' } do
      folder:write("scene.lua", head .. write .. " return " .. chain .. "\n")
      local result = command.rapid("run scene.lua -f 1 --quiet", { cwd = folder.path })
      assert.match('path = "scene%.lua": grids can only be written as %.vdb; give a name such as "surface%.vdb"\n$',
        result.stderr)
      assert.equal(2, result.status)
      assert.same({ "scene.lua" }, folder:list())
    end
  end)
end)
