-- What Rapid says in place of LuaJIT's own messages. Nothing but this table knows how LuaJIT words them.
--
-- full_stack: the stack is full when the error is raised, and leaves no room for a trace.

-- memory_limit: the text for a state that needs more memory than it may have.
return function(memory_limit)
  return {
    ["not enough memory"] = { message = memory_limit },
    ["stack overflow"] = { message = "stack overflow: a function calls itself without end", full_stack = true },
    -- `p.v.x = 1`
    ["attempt to write to constant location"] = {
      message = "neither a component nor the frame can be assigned; make a new vec3: p.v = vec3(1, p.v.y, p.v.z)",
    },
  }
end
