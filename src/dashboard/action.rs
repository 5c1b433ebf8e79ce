//! Everything that a user can ask for by a key, a hint or the palette.

/// A direction on the screen, or along the view.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Direction {
    /// To the left.
    Left,
    /// To the right.
    Right,
    /// Upwards.
    Up,
    /// Downwards.
    Down,
    /// Into the picture.
    In,
    /// Out of the picture.
    Out,
}

/// How far one step goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StepSize {
    /// A step that is seen at once.
    Coarse,
    /// A tenth of it.
    Fine,
}

/// More or less.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Delta {
    /// More.
    Up,
    /// Less.
    Down,
}

/// Everything that a user can ask for. What it acts on is the selection, unless it says otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Action {
    // Camera
    /// Turns the eye about the target.
    Orbit(Direction),
    /// Shifts eye and target in the plane of the picture.
    Pan(Direction),
    /// Moves the eye towards the target, or away.
    Dolly(Direction, StepSize),
    /// Turns the view where the eye stands.
    ViewImage(Direction),
    /// Moves eye and target together, along the view's own axes.
    Fly(Direction),
    /// Turns the picture about its centre.
    Roll(Direction),
    /// Widens or narrows the view angle.
    ViewAngle(Delta),
    /// Fills the picture with the selection.
    Frame,
    /// The camera as the file has it.
    ResetCamera,
    /// Stores the camera in the scene, under a name that is asked for.
    StoreView,
    /// The stored view of this number, from 1.
    RecallView(u8),

    // Modes of the picture
    /// Arrows move the selection.
    MoveMode,
    /// Arrows turn the selection.
    TurnMode,
    /// Letters fly the camera.
    FlyMode,
    /// Moves the selection as the camera sees it: `Left`, `Right`, `In` (away) and `Out` (nearer) in
    /// the ground plane, `Up` and `Down` in height.
    Move(Direction, StepSize),
    /// Turns the selection about the vertical.
    Rotate(Direction, StepSize),
    /// Ends the mode.
    Cancel,

    // Light
    /// Selects the next light.
    NextLight,
    /// The selected light, else the first one, brighter or darker.
    Intensity(Delta, StepSize),
    /// Switches the selected light, else the first one.
    SwitchLight,
    /// A form for a new light.
    AddLight,

    // Mirror
    /// Roughness of the selected reflecting object, else of the scene's mirror.
    Roughness(Delta, StepSize),
    /// Reflection coefficient of the same.
    Reflection(Delta),
    /// The next lobe of the same.
    NextLobe,

    // Objects
    /// A form for a new object.
    AddObject,
    /// A copy of the selection beside it.
    Duplicate,
    /// Removes the selection.
    Delete,
    /// Asks for a new name.
    Rename,
    /// Puts the selected object on what is below it.
    SnapToGround,
    /// Gives the selected object a material of its own.
    OwnMaterial,

    // Panels and selection
    /// The next panel.
    NextPanel,
    /// The panel before.
    PreviousPanel,
    /// Shows or hides everything but the picture.
    ToggleFullscreen,
    /// Moves the cursor of a panel, list or form.
    Cursor(Direction),
    /// The first line of a panel, list or form.
    First,
    /// The last line.
    Last,
    /// A page up or down.
    Page(Direction),
    /// Opens what is under the cursor: types into the field, chooses the entry, confirms.
    Open,
    /// Changes the field under the cursor by a step.
    Step(Delta, StepSize),
    /// The field under the cursor as it is when the file does not give it.
    ClearField,

    // History and file
    /// Takes back the last edit.
    Undo,
    /// Does it again.
    Redo,
    /// Writes the scene file.
    Save,
    /// Writes the scene to another file.
    SaveAs,
    /// Reads the file again.
    Reload,
    /// Takes up the unsaved edits of a session that broke off.
    Recover,
    /// Gives the terminal to the shell until it calls back.
    Suspend,
    /// Ends the program; asks if there are unsaved edits.
    Quit,

    // Picture
    /// Stops or continues tracing.
    Pause,
    /// Begins the picture anew.
    Restart,
    /// Asks when to stop: noise, samples, seconds.
    StopAt,
    /// Shows what each noise costs here, and stops at the chosen one.
    Quality,
    /// Writes the picture as PNG.
    ExportPng,
    /// Writes the picture as EXR.
    ExportExr,
    /// Copies the path of the last picture that was written.
    CopyPath,
    /// Shows the last picture that was written.
    ShowExport,
    /// Renders at another size, asked for, into a file.
    ExportSized,
    /// Ends a running export of another size.
    CancelExport,
    /// Exposure by a quarter of a stop.
    Exposure(Delta),
    /// Exposure 0.
    ResetExposure,
    /// The next tone curve.
    NextTone,
    /// The next view: beauty, noise, samples, objects, normals, depth.
    NextChannel,
    /// The view before.
    PreviousChannel,
    /// Shows a pixel in numbers, or ends that.
    Probe,
    /// Moves the probe over the picture: by a cell, or by a pixel of the film.
    MoveProbe(Direction, StepSize),
    /// Keeps the picture for comparison.
    Keep,
    /// Flips between the kept and the live picture.
    Flip,
    /// Shows the difference between the kept and the live picture.
    Difference,
    /// More or fewer threads.
    Threads(Delta),
    /// Lower or normal priority of the tracing threads.
    Priority,
    /// The next of the terminal's colour modes.
    NextColors,

    // Help
    /// All keys.
    Help,
    /// Finds an action by typing.
    Palette,
    /// What the compiled scene contains.
    Inventory,
}
