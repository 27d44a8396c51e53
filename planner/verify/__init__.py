"""The promise of a plan checked by a second code: recount, Monte Carlo, a few units through files; sweeps.

Plan and verify must not be one code that agrees with itself. Shared with the planner are the effects'
regressors, the reading of the spec, units, and physics that is held to an independent implementation. Of its
own verify has all that stands between them:

- what a bench does to a unit (exposures), the records of a plan's steps, power-on by power-on (records);
- draws, one after the other and never from a covariance of the whole campaign (draws, curves, references);
- the measurement equation, the design matrix and the estimator (declared, nodes, calibrations);
- what flies and what a correction leaves (residuals, structure, flights, beside);
- a plan's figures, counted again from plan.json and the spec (recount_…), sensitivities by differences of
  nonlinear flights.

It imports neither the planner's stages nor its simulator nor its estimator: contracts in pyproject.toml say
so. Where the real `calibrate` and `apply` are wanted (through_files), whoever calls verify hands them in.
"""
