// SPDX-License-Identifier: GPL-3.0-or-later
// Scan Relight as a job type of Flamenco 3: put this file into the manager's folder "scripts" (docs/farm.md).

const JOB_TYPE = {
    label: "Scan Relight",
    description: "Recover albedo, shading and lamps of a scanned room",
    settings: [
        { key: "capture", type: "string", subtype: "dir_path", required: true,
          description: "Folder of the capture, on storage that all workers share" },
        { key: "result", type: "string", subtype: "dir_path", required: true,
          description: "Result folder, on the same storage" },
        { key: "blocks", type: "int32", default: 1, propargs: { min: 1, max: 1000 },
          description: "Parts of a stage that can be divided between workers" },
        { key: "options", type: "string", default: "",
          description: "Options of 'scan-relight stage', parted by blanks, or as a JSON list" },
        { key: "program", type: "string", default: "{scan_relight}", visible: "submission",
          description: "What workers run: a path, or a variable of the manager's configuration" },
        { key: "program_args", type: "string", default: "", visible: "submission",
          description: "What comes before our arguments, such as --command scan_relight for Blender" },
        // Paths have settings of their own, as the manager puts its two-way variables only where a value begins with one.
        { key: "mesh", type: "string", subtype: "file_path", visible: "submission", description: "As --mesh" },
        { key: "exposures", type: "string", subtype: "file_path", visible: "submission", description: "As --exposures" },
        { key: "segments", type: "string", subtype: "file_path", visible: "submission", description: "As --segments" },
        { key: "override", type: "string", subtype: "file_path", visible: "submission", description: "As --override" },
    ],
};

const STAGES = ["surface", "lit_diffuse", "shading", "specular", "write"];
const DIVIDED = ["specular"];
const PATHS = ["mesh", "exposures", "segments", "override"];

function compileJob(job) {
    const settings = job.settings;
    const blocks = settings.blocks || 1;
    if (!settings.capture || !settings.result) {
        throw "A capture and a result folder are needed.";
    }
    if (blocks < 1 || blocks !== Math.floor(blocks)) {
        throw `A stage can't be divided into ${blocks} blocks; give 1 or more.`;
    }
    let before = [];
    for (const stage of STAGES) {
        if (DIVIDED.indexOf(stage) >= 0 && blocks > 1) {
            const parts = [];
            for (let i = 1; i <= blocks; i++) {
                parts.push(addTask(job, `${stage}-${i}-of-${blocks}`, ["--stage", stage, "--block", `${i}/${blocks}`], before));
            }
            before = parts;
        }
        before = [addTask(job, stage, ["--stage", stage], before)];
    }
}

function addTask(job, name, what, before) {
    const settings = job.settings;
    const args = words(settings.program_args).concat(
        ["stage", settings.capture, "--out", settings.result], what, words(settings.options));
    for (const key of PATHS) {
        if (settings[key]) {
            args.push(`--${key}`, settings[key]);
        }
    }
    const task = author.Task(name, "misc");
    task.addCommand(author.Command("exec", { exe: settings.program || "{scan_relight}", args: args }));
    for (const one of before) {
        task.addDependency(one);
    }
    job.addTask(task);
    return task;
}

function words(text) {
    const trimmed = (text || "").trim();
    if (trimmed.startsWith("[")) {
        return JSON.parse(trimmed);
    }
    return trimmed ? trimmed.split(/\s+/) : [];
}
