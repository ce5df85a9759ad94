-- Scenes by the place in which a script runs. %s in each is the script, on line 2.
return {
  body = "\n%s\nreturn rapid.create { points = two } :solve {}",
  kernel = "return rapid.create { points = two } :points('k', function(p, frame)\n%s\nend) :solve {}",
  test = "return rapid.create { points = two } :delete { where = function(p)\n%s\nend } :solve {}",
  action = "return rapid.create { points = two } :action('a', function(p, step)\n%s\nend) :solve {}",
  detail = "return rapid.create { points = two } :detail('d', function(points, frame)\n%s\nend) :solve {}",
  parameter = "return rapid.create { points = two } :gravity { g = function(frame)\n%s\nend } :solve {}",
}
