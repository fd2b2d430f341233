"""Commands that make and judge the weights, a module each; `evals/` has the actions of `eval`, `sheets/` its
pictures. The product's commands are in `commands/`."""
