"""Where and why an agent fails: failed flights once more, what caused them, and how to look at them."""
