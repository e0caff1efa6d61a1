"""Pictures of postures, from bodies down to pixels: `anatomy`, `solids`, `figure`, `sheet`."""
