"""Pictures: figures for papers with Matplotlib, and `render_mode` of the environments, all without a display.

`render_mode="rgb_array"`: `render()` returns (height, width, 3) uint8, a new array, equal bytes for equal episodes.
`render_mode="human"`: a window shows every tick of a flight in real time, from reset on; it needs the extra `render`.
Closing the window ends the showing, not the episode, which then goes on at full speed. Drawing changes nothing about an
episode. `render_size` is width and height in pixels, even, from 64 to 4096. `camera`:

- "overview" sees the whole box from the side of the way to the goal. The vehicle is drawn 2.5 times its true size, more
  in small pictures; its centre, like everything else, is where it is.
- "chase" follows the vehicle from behind; all sizes are true, and water and floor go on beyond the box.

docs/rendering.md shows both and how videos are made. A module imports only from lines below its own:

    what is asked for   view (environments, windows) · video · replay (pages) · foxglove · figures · comparison
    what is drawn on    frame (pictures) · stage (pages) · scene3d, files (figures)
    with what           shapes · raycast
    what rays meet      solids, backdrop
    what there is       track (flights) · camera · paths · style

What an obstacle looks like, each of them asks `hydrone_gym.world.bodies`.
"""
