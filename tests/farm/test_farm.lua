-- Tests --farm slurm and rapid farm with a Slurm cluster of one node that these tests start and stop.
local command = require "testing.command"
local json = require "dkjson"

local folder = command.folder()
local slurm = folder:file "slurm"

-- The cluster ends with this process, the shell's parent.
local started = command.shell(("exec tests/farm/slurm_daemons start %s %s 4"):format(
  slurm, command.shell("echo $PPID").stdout:gsub("%s+$", "")))
local environment = { SLURM_CONF = slurm .. "/slurm.conf" }

local function rapid(arguments)
  return command.rapid(arguments, { cwd = folder.path, environment = environment })
end

local function done(arguments)
  local result = rapid(arguments)
  assert.equal("", result.stderr, arguments)
  assert.equal(0, result.status, arguments)
  return result.stdout
end

local function shell(line)
  return command.shell(line, { cwd = folder.path, environment = environment })
end

-- Waits up to a minute until all tasks of a job are settled. "waits": a task will never run.
local function settled(file)
  local tasks
  for _ = 1, 300 do
    tasks = json.decode(rapid("farm status --json " .. file).stdout).tasks
    local open = false
    for _, task in ipairs(tasks) do
      open = open or task.state == "running" or (task.state == "waiting" and task.why ~= "DependencyNeverSatisfied")
    end
    if not open then return tasks end
    shell "sleep 0.2"
  end
  error "tasks did not end within a minute"
end

local function states(tasks)
  local list = {}
  for k, task in ipairs(tasks) do list[k] = task.state end
  return table.concat(list, " ")
end

folder:write("drops.lua", [[
local rapid = require "rapid"
local rate = rapid.param("rate", 2000, "a second")
return rapid.create { seed = 3 }
  :emit { source = rapid.shape.sphere {}, rate = rate, speed = {1, 2}, spread = 40, attributes = { Cd = {1, 0.5, 0} } }
  :gravity {}
  :collide { shape = rapid.shape.plane { offset = -1 }, bounce = 0.4 }
  :solve {}
]])
folder:write("coupled.lua", [[
local rapid = require "rapid"
return rapid.create {} :emit { source = rapid.shape.sphere {}, rate = 9, attributes = { pscale = 0.1 } }
  :contact {} :solve {}
]])

describe("the private Slurm", function()
  it("starts", function()
    assert.equal("", started.stderr)
    assert.equal(0, started.status)
    assert.matches("idle", shell("sinfo -h -o %T").stdout)
  end)
end)

describe("rapid run --farm slurm", function()
  it("computes parts in tasks and merges them to the files of the whole run", function()
    done "run drops.lua -f 1-8 -o 'whole/a.####.bgeo' --quiet"
    local said = done("run drops.lua -f 1-8 -o 'out/a.####.bgeo' --stats out/s.json --farm slurm --parts 5 "
      .. "--farm-options '-c 2 --nice=3'")
    local array, last = said:match "job (%d+): 5 tasks\njob (%d+): merge, after the others\n"
    assert.truthy(array, said)
    local submitted = json.decode((folder:read "out/FARM.json"))
    assert.equal(tonumber(array), submitted.tasks[5].job)
    assert.equal(tonumber(last), submitted.last.job)
    assert.same({ "-c", "2", "--nice=3" }, submitted.options)
    assert.equal("done done done done done done", states(settled "out/FARM.json"))
    for frame = 1, 8 do
      local name = ("/a.%04d.bgeo"):format(frame)
      assert.truthy(folder:read("whole" .. name) == folder:read("out" .. name), name)
    end
    assert.matches("rapid%-drops: 6 tasks: 6 done", done "farm status out/FARM.json")
    assert.matches("NumCPUs=2", shell("scontrol show job " .. array).stdout)
    assert.equal(2, json.decode((folder:read "out/s_part3of5.json")).threads)
    assert.equal("nothing has failed\n", done "farm retry out/FARM.json")
  end)

  it("keeps the other tasks if one fails, and runs missing ones again", function()
    shell "mkdir -p fail/a_part2of3.0003.bgeo" -- a folder with the name of an output file
    done "run drops.lua -f 1-8 -o 'fail/a.####.bgeo' --farm slurm --parts 3"
    assert.equal("done failed done waiting", states(settled "fail/FARM.json"))
    local status = rapid "farm status fail/FARM.json"
    assert.equal(1, status.status)
    assert.matches("part 2of3: failed, status 1, .*fail/FARM/2.log", status.stdout)
    assert.matches("a_part2of3.0003.bgeo", folder:read "fail/FARM/2.log", 1, true)
    assert.truthy(folder:read "fail/a_part3of3.0008.bgeo")

    shell "rmdir fail/a_part2of3.0003.bgeo"
    assert.matches("job %d+: 1 tasks repeated: 2\njob %d+: merge", done "farm retry fail/FARM.json")
    assert.equal("done done done done", states(settled "fail/FARM.json"))
    for frame = 1, 8 do
      local name = ("/a.%04d.bgeo"):format(frame)
      assert.truthy(folder:read("whole" .. name) == folder:read("fail" .. name), name)
    end
  end)

  it("runs again a task that was killed, and merges the same files", function()
    done "run drops.lua -f 1-8 -o 'kill/a.####.bgeo' --farm slurm --parts 4 --farm-options --hold"
    local submitted = json.decode((folder:read "kill/FARM.json"))
    local array = submitted.tasks[1].job
    shell(("scancel %d_3; scontrol release %d"):format(array, array))
    shell(("scontrol release %d"):format(submitted.last.job))
    assert.equal("done done lost done waiting", states(settled "kill/FARM.json"))
    done "farm retry kill/FARM.json"
    submitted = json.decode((folder:read "kill/FARM.json"))
    shell(("scontrol release %d; scontrol release %d"):format(submitted.tasks[3].job, submitted.last.job))
    assert.equal("done done done done done", states(settled "kill/FARM.json"))
    assert.truthy(folder:read "whole/a.0008.bgeo" == folder:read "kill/a.0008.bgeo")
  end)

  it("continues after the last snapshot of a task that was requeued or killed", function()
    folder:write("slow.lua", [[
local rapid = require "rapid"
local function rate(frame)
  local sum = 0
  for k = 1, 6e7 do sum = sum + k % 7 end
  return sum > 0 and 500 + frame.number or 0
end
return rapid.create { seed = 5 } :emit { source = rapid.shape.sphere {}, rate = rate } :gravity {} :solve {}
]])
    done "run slow.lua -f 1-40 -o 'slow/w.####.ply' --quiet"
    done "run slow.lua -f 1-40 -o 'slow/a.####.ply' --cache-every 2 --farm slurm --parts 2"
    local array = json.decode((folder:read "slow/FARM.json")).tasks[1].job
    for _ = 1, 300 do
      local snapshots = 0
      for part = 1, 2 do
        local found = shell(("ls slow/FARM/cache/%dof2"):format(part)).stdout:match "snapshot"
        snapshots = snapshots + (found and 1 or 0)
      end
      if snapshots == 2 then break end
      shell "sleep 0.1"
    end
    assert.equal(0, shell(("scancel --signal=KILL %d_2"):format(array)).status)
    assert.equal(0, shell(("scontrol requeue %d_1"):format(array)).status)
    shell "sleep 2"
    assert.equal(0, shell(("scontrol update JobId=%d_1 StartTime=now"):format(array)).status) -- skips a delay
    assert.matches("^done %l+ waiting$", states(settled "slow/FARM.json"))
    assert.equal(1, rapid("farm status slow/FARM.json").status)
    assert.is_nil(folder:read "slow/a_part2of2.0040.ply") -- it was killed while running
    done "farm retry slow/FARM.json"
    assert.equal("done done done", states(settled "slow/FARM.json"))
    for frame = 1, 40 do
      local name = (".%04d.ply"):format(frame)
      assert.truthy(folder:read("slow/w" .. name) == folder:read("slow/a" .. name), name)
    end
  end)

  it("submits the whole run as one task without --parts", function()
    done "run drops.lua -f 1-4 --set rate=500 -o 'one/a.####.csv' --stats one/s.json --farm slurm"
    assert.equal("done", states(settled "one/FARM.json"))
    assert.equal(1, json.decode((folder:read "one/s.json")).threads) -- of the one processor that it was given
    done "run drops.lua -f 1-4 --set rate=500 -o 'direct/a.####.csv' --quiet"
    assert.equal(folder:read "direct/a.0004.csv", folder:read "one/a.0004.csv")
  end)

  it("obeys the memory of the job, whether it is given per node or per processor", function()
    for k, options in ipairs { "--mem=60", "--mem-per-cpu=30 -c 2" } do
      local name = ("memory%d/"):format(k)
      done(("run drops.lua -f 1-4 --set rate=50000000 -o '%sa.####.csv' --farm slurm --farm-options '%s'")
        :format(name, options))
      assert.equal("failed", states(settled(name .. "FARM.json")))
      assert.matches("of 60 MiB are free", folder:read(name .. "FARM/1.log"), 1, true)
    end
  end)

  it("prints scripts that a shell reads, and submits nothing, with --dry-run", function()
    local result = command.rapid("run drops.lua -f 1-4 -o \"it's/a.####.csv\" --farm slurm --parts 3 --dry-run",
                                 { cwd = folder.path, environment = { PATH = "/usr/bin/none" } })
    assert.equal("", result.stderr)
    assert.equal(0, result.status)
    assert.matches("2) set -- --part=2/3 ", result.stdout, 1, true)
    assert.matches("#SBATCH --requeue", result.stdout, 1, true)
    assert.is_nil(folder:read "it's/FARM.json")
    folder:write("printed.sh", result.stdout)
    assert.equal(0, shell("bash -n printed.sh").status)
  end)

  it("reports mistakes before it submits", function()
    for arguments, text in pairs {
      ["coupled.lua -o 'c/a.####.csv' --farm slurm --parts 2"] = 'node "contact1"',
      ["drops.lua -o 'c/a.####.png' --farm slurm --parts 2"] = "files of parts can't be merged",
      ["drops.lua -o 'c/{part}.####.csv' --farm slurm --parts 2"] = "{part}",
      ["drops.lua --farm slurm --parts 2"] = "give -o",
      ["drops.lua --parts 2"] = "--parts needs --farm slurm",
      ["drops.lua --dry-run"] = "--dry-run needs --farm slurm",
      ["drops.lua --farm-options x"] = "--farm-options needs --farm slurm",
      ["drops.lua --farm lsf"] = "it must be slurm",
      ["drops.lua --farm slurm --watch"] = "--watch",
      ["drops.lua --farm slurm --untrusted"] = "--untrusted",
      ["drops.lua --farm slurm --farm-options 'a \"b'"] = "is not closed",
      ["drops.lua -o 'c/a.####.csv' --farm slurm --farm-options --partition=nowhere"] = "sbatch failed",
    } do
      local result = rapid("run " .. arguments)
      assert.equal(2, result.status, arguments)
      assert.matches(text, result.stderr, 1, true)
    end
    assert.is_nil(folder:read "c/FARM.json")
  end)

  it("names the missing program if there is no Slurm", function()
    local result = command.rapid("run drops.lua -o 'd/a.####.csv' --farm slurm",
                                 { cwd = folder.path, environment = { PATH = "/nowhere" } })
    assert.equal(2, result.status)
    assert.matches("sbatch and squeue and scancel are not on the PATH; install slurm-client, or see the scripts " ..
      "with --dry-run", result.stderr, 1, true)
  end)
end)

describe("rapid farm", function()
  it("cancels queued tasks, reports them as lost, and retries them", function()
    done "run drops.lua -f 1-4 -o 'held/a.####.csv' --farm slurm --parts 3 --farm-options --hold"
    assert.equal("waiting waiting waiting waiting", states(json.decode(done "farm status --json held/FARM.json").tasks))
    local again = rapid "run drops.lua -f 1-4 -o 'held/b.####.csv' --farm slurm"
    assert.equal(2, again.status)
    assert.matches("4 tasks of the job in .*held/FARM.json are queued or run", again.stderr)
    assert.equal("4 tasks cancelled\n", done "farm cancel held/FARM.json")
    settled "held/FARM.json"
    local status = rapid "farm status held/FARM.json"
    assert.equal(1, status.status)
    assert.matches("4 lost", status.stdout)
    -- The retried job is held again, as its options demand, and then released.
    done "farm retry held/FARM.json"
    local submitted = json.decode((folder:read "held/FARM.json"))
    shell(("scontrol release %d %d"):format(submitted.tasks[1].job, submitted.last.job))
    assert.equal("done done done done", states(settled "held/FARM.json"))
    done "run drops.lua -f 1-4 -o 'held/w.####.csv' --quiet"
    assert.equal(folder:read "held/w.0004.csv", folder:read "held/a.0004.csv")
  end)

  it("refuses files that are none", function()
    folder:write("none.json", "{}")
    for _, name in ipairs { "none.json", "missing.json", "drops.lua" } do
      local result = rapid("farm status " .. name)
      assert.equal(2, result.status)
      assert.matches(name, result.stderr, 1, true)
    end
  end)
end)

describe("rapid wedge --farm slurm", function()
  it("runs each row as a task, and summarises all at the end", function()
    done "wedge drops.lua --vary rate=500,1000,2000 -f 1-6 -o 'w/{rate}.####.csv' --farm slurm"
    assert.equal("done done done done", states(settled "w/FARM.json"))
    local report = json.decode((folder:read "w/wedge.json"))
    done "wedge drops.lua --vary rate=500,1000,2000 -f 1-6 -o 'here/{rate}.####.csv' --quiet"
    local here = json.decode((folder:read "here/wedge.json"))
    for k, row in ipairs(here.rows) do
      assert.equal(row.points, report.rows[k].points)
      assert.equal(row.contacts, report.rows[k].contacts)
      assert.equal("done", report.rows[k].status)
      local name = ("/%s.0006.csv"):format(row.settings.rate)
      assert.equal(folder:read("here" .. name), folder:read("w" .. name))
    end
    assert.matches("rate", folder:read "w/FARM/last.log")
  end)
end)
