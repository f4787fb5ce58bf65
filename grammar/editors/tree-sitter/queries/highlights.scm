(comment) @comment
(text) @string
(colour) @constant
(number) @number
(measure) @number
(count) @number
(cue_number) @number
(size) @number
(stops) @number
(extinction) @number

["show" "preview" "include" "gels" "let" "stage" "surface" "figure" "haze" "view" "light" "point" "bank" "fixed"
 "group" "look" "default" "curve" "effect" "cue"] @keyword

["tolerance" "gap" "rate" "exposure" "white" "tone" "dither" "coarse" "refined" "auto" "filmic"
 "plain" "on" "off" "z" "y" "up" "one-sided" "matt" "scale" "at" "turn" "reflectance" "gloss" "quad" "box" "disc"
 "cylinder" "sphere" "from" "to" "aim" "radius" "sides" "height" "facing" "inside" "two-sided" "forward" "albedo" "fov" "lens" "roll"
 "size" "beam" "field" "moves" "pan" "tilt" "zoom" "speed" "standing" "spot" "lantern" "panel" "photometric" "project" "like" "image" "layer" "channel"
 "dimmer" "rgb" "level" "full" "out" "spline" "spread" "linear" "steps" "natural" "clamped" "catmull-rom"
 "monotone" "hermite" "bezier" "slope" "via" "flicker" "pulse" "depth" "seed" "time" "down" "delay"
 "follow" "hang" "repeat" "part" "note" "block" "assert" "cueonly"] @keyword.modifier

[(snap) (blackout)] @keyword.modifier

(bank name: (name) @variable)
(light name: (name) @type)
(point name: (name) @variable)
(aim (name) @variable)
(look name: (name) @function)
(group name: (name) @variable)
(target (name) @variable)
(names (name) @type)

["{" "}" "(" ")"] @punctuation.bracket
["," "." "="] @punctuation.delimiter
["+" "-" "*" "/"] @operator
