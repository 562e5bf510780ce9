"""Pictures from arrays: the paper's figures as Matplotlib figures, drawn without a display."""
